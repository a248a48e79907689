/// @file Writes valid and damaged MAT files of version 7.3: HDF5 with object headers of version 2.
#pragma once

#include <zlib.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "pth_writer.h"

namespace swarmcert::tests {

/// Returns a header message; `type` as in the specification of the format.
inline std::string hdf5_message(int type, const std::string& contents, int flags = 0) {
  return little_endian(static_cast<std::uint64_t>(type), 1) + little_endian(contents.size(), 2) +
         little_endian(static_cast<std::uint64_t>(flags), 1) + contents;
}

inline std::string hdf5_shape(const std::vector<std::uint64_t>& sizes) {
  std::string contents = little_endian(2, 1) + little_endian(sizes.size(), 1) + little_endian(0x100, 2);
  for (const std::uint64_t size : sizes) contents += little_endian(size, 8);
  return hdf5_message(1, contents);
}

/// Return the datatype messages of float64 and of references to objects.
inline std::string hdf5_double() {
  return hdf5_message(3, std::string("\x11\x20\x3f\0", 4) + little_endian(8, 4) +
                             std::string("\0\0\x40\0\x34\x0b\0\x34", 8) + little_endian(1023, 4));
}
inline std::string hdf5_reference() {
  return hdf5_message(3, std::string("\x17\0\0\0", 4) + little_endian(8, 4));
}

inline std::string hdf5_contiguous(std::uint64_t address, std::uint64_t size) {
  return hdf5_message(8, std::string("\3\1") + little_endian(address, 8) + little_endian(size, 8));
}

/// @param shape  of a chunk, without the element size, which is 8.
inline std::string hdf5_chunked(std::uint64_t tree, const std::vector<std::uint64_t>& shape) {
  std::string contents = std::string("\3\2") + little_endian(shape.size() + 1, 1) + little_endian(tree, 8);
  for (const std::uint64_t size : shape) contents += little_endian(size, 4);
  return hdf5_message(8, contents + little_endian(8, 4));
}

inline std::string hdf5_filters(const std::vector<std::uint64_t>& filters) {
  std::string contents = little_endian(2, 1) + little_endian(filters.size(), 1);
  for (const std::uint64_t filter : filters) contents += little_endian(filter, 2) + little_endian(0, 4);
  return hdf5_message(0xb, contents);
}

/// Returns the attribute MATLAB_class.
inline std::string hdf5_class(const std::string& name) {
  const std::string type = std::string("\x13\0\0\0", 4) + little_endian(name.size(), 4);
  const std::string shape = little_endian(2, 4);  // a single text
  const std::string key("MATLAB_class", 13);
  return hdf5_message(0xc, std::string("\3\0", 2) + little_endian(key.size(), 2) +
                               little_endian(type.size(), 2) + little_endian(shape.size(), 2) +
                               std::string(1, '\0') + key + type + shape + name);
}

inline std::string hdf5_link(const std::string& name, std::uint64_t address, char kind = 0) {
  return hdf5_message(
      6, std::string("\1\x8") + kind + little_endian(name.size(), 1) + name + little_endian(address, 8));
}

inline std::string hdf5_continuation(std::uint64_t address, std::uint64_t size) {
  return hdf5_message(0x10, little_endian(address, 8) + little_endian(size, 8));
}

inline std::string hdf5_object(const std::string& messages) {
  return std::string("OHDR\2\2") + little_endian(messages.size(), 4) + messages + little_endian(0, 4);
}

struct Hdf5Chunk {
  std::vector<std::uint64_t> corner;  ///< in elements
  std::uint64_t address = 0, size = 0;
};

/// Returns a node of the B-tree of chunks; at level 0 its children are the chunks themselves.
inline std::string hdf5_chunk_tree(const std::vector<Hdf5Chunk>& chunks, std::uint64_t level = 0) {
  std::string bytes = std::string("TREE\1") + little_endian(level, 1) + little_endian(chunks.size(), 2) +
                      std::string(16, '\xff');
  for (const Hdf5Chunk& chunk : chunks) {
    bytes += little_endian(chunk.size, 4) + little_endian(0, 4);
    for (const std::uint64_t at : chunk.corner) bytes += little_endian(at, 8);
    bytes += little_endian(0, 8) + little_endian(chunk.address, 8);
  }
  return bytes;
}

inline std::string deflated(const std::string& bytes) {
  uLongf size = compressBound(static_cast<uLong>(bytes.size()));
  std::string packed(size, '\0');
  compress2(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()),
            static_cast<uLong>(bytes.size()), Z_BEST_COMPRESSION);
  packed.resize(size);
  return packed;
}

/// Writes consecutive objects after MATLAB's header; addresses are relative to the superblock.
class Mat73Writer {
 public:
  /// Returns the address of the next piece.
  std::uint64_t end() const { return kSuperblock_bytes + body_.size(); }

  /// Appends `piece` and returns its address.
  std::uint64_t add(const std::string& piece) {
    const std::uint64_t address = end();
    body_ += piece;
    return address;
  }

  /// Adds a matrix with `sizes` as MATLAB states them and its numbers in column-major order.
  std::uint64_t add_matrix(const std::vector<std::uint64_t>& sizes, const std::vector<double>& numbers) {
    const std::uint64_t elements = add(raw_numbers(numbers));
    return add(hdf5_object(hdf5_shape({sizes.rbegin(), sizes.rend()}) + hdf5_double() +
                           hdf5_contiguous(elements, 8 * numbers.size()) + hdf5_class("double")));
  }

  std::string file(std::uint64_t root) const {
    std::string head = "MATLAB 7.3 MAT-file";
    head.resize(124, ' ');
    head += std::string("\0\2IM", 4);
    head.resize(512, '\0');
    return head + std::string("\x89HDF\r\n\x1a\n\2\x8\x8\0", 12) + little_endian(512, 8) +
           std::string(8, '\xff') + little_endian(512 + end(), 8) + little_endian(root, 8) +
           little_endian(0, 4) + body_;
  }

  /// Returns the file whose root group has these links.
  std::string file_with(const std::vector<std::pair<std::string, std::uint64_t>>& links) {
    std::string messages;
    for (const auto& [name, address] : links) messages += hdf5_link(name, address);
    return file(add(hdf5_object(messages)));
  }

 private:
  static constexpr std::uint64_t kSuperblock_bytes = 48;
  std::string body_;
};

/// Returns a file with two layers, 2-2-1, as the cell arrays "weights" and "biases".
inline std::string small_mat73() {
  Mat73Writer writer;
  const auto cells = [&writer](const std::vector<std::uint64_t>& objects) {
    const std::uint64_t elements = writer.add(raw_numbers(objects));
    return writer.add(hdf5_object(hdf5_shape({objects.size(), 1}) + hdf5_reference() +
                                  hdf5_contiguous(elements, 8 * objects.size()) + hdf5_class("cell")));
  };
  const std::uint64_t weights =
      cells({writer.add_matrix({2, 2}, {1, 2, 3, 4}), writer.add_matrix({1, 2}, {5, 6})});
  const std::uint64_t biases =
      cells({writer.add_matrix({2, 1}, {0.5, -0.5}), writer.add_matrix({1, 1}, {0.25})});
  return writer.file_with({{"weights", weights}, {"biases", biases}});
}

}  // namespace swarmcert::tests
