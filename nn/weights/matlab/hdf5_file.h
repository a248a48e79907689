/// @file The subset of HDF5 that MATLAB's -v7.3 files use: the superblock, object headers and attributes.
/// Follows the "HDF5 File Format Specification", version 3.0. The HDF5 library is not used because it is too large an
/// attack surface for untrusted files. Checksums of object headers are not verified.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace swarmcert::files {

/// The undefined address.
inline constexpr std::uint64_t kNoAddress = ~std::uint64_t{0};

/// Hint for a file that uses HDF5 features which this reader does not support.
inline constexpr char kSaveAsVersion7[] =
    "load it in MATLAB, then save('net.mat', 'weights', '-v7'), or write it with scipy.io.savemat";

/// A piece of a file, read sequentially. Reading beyond its end is an error.
class Hdf5Piece {
 public:
  /// @param data, path  must outlive the piece.
  /// @param offset  position of `data` in the file.
  Hdf5Piece(std::string_view data, std::size_t offset, const std::string& path)
      : data_(data), offset_(offset), path_(&path) {}

  std::size_t left() const { return data_.size() - at_; }
  std::size_t offset() const { return offset_ + at_; }

  /// Return the next `size` bytes, or an unsigned little-endian number of `size` <= 8 bytes.
  std::string_view take(std::uint64_t size);
  std::uint64_t number(std::size_t size);
  Hdf5Piece piece(std::uint64_t size);
  void skip(std::uint64_t size) { take(size); }
  /// Skips the padding that aligns the bytes read since the beginning to a multiple of 8.
  void skip_padding();

  /// @throws InputError unless the next bytes are `signature`.
  void expect(std::string_view signature);
  /// @throws InputError unless `number` equals `expected`; the hint is to save the file in an older version.
  void require(const char* field, std::uint64_t number, std::uint64_t expected) const;
  [[noreturn]] void refuse(const std::string& field, const std::string& value, const std::string& what,
                           const std::string& hint) const;

 private:
  std::string_view data_;
  std::size_t offset_;
  const std::string* path_;
  std::size_t at_ = 0;
};

/// Types of header messages.
enum class Hdf5Kind : std::uint16_t {
  kDataspace = 0x1,
  kLinkInfo = 0x2,
  kDatatype = 0x3,
  kLink = 0x6,
  kExternalFiles = 0x7,
  kLayout = 0x8,
  kFilters = 0xb,
  kAttribute = 0xc,
  kContinuation = 0x10,
  kSymbolTable = 0x11,
  kAttributeInfo = 0x15
};

struct Hdf5Message {
  Hdf5Kind kind;
  bool is_shared = false;  ///< its contents are stored elsewhere
  Hdf5Piece contents;
};

/// A group or dataset, as described by its object header.
struct Hdf5Object {
  std::size_t offset = 0;
  std::vector<Hdf5Message> messages;

  /// Returns the contents of the only message of this kind, or nothing if there is none.
  /// @throws InputError if there are several, or if it is shared.
  std::optional<Hdf5Piece> find(Hdf5Kind kind) const;
};

/// A node of a version 1 B-tree.
struct Hdf5TreeNode {
  std::uint64_t level = 0;  ///< 0: its children are not nodes
  std::uint64_t count = 0;  ///< number of children
  Hdf5Piece entries;        ///< keys and children
};

/// A whole file in memory. Everything reached through an address counts against two limits, so that repeated references
/// to the same place cost no more than reading a large network.
class Hdf5File {
 public:
  /// @param bytes, path  must outlive this object.
  /// @param start  position of the superblock; addresses are relative to it.
  /// @throws InputError unless this is a superblock of version 0, 2 or 3 with 8-byte addresses and lengths.
  Hdf5File(const std::string& bytes, std::size_t start, const std::string& path);

  std::uint64_t root() const { return root_; }
  std::size_t size_bytes() const { return bytes_.size(); }

  /// @throws InputError if these bytes are outside the file.
  Hdf5Piece at(std::uint64_t address, std::uint64_t size) const;
  /// Returns the bytes from `address` to the end of the file.
  Hdf5Piece from(std::uint64_t address) const;

  /// @throws InputError unless there is an object header of version 1 or 2 at `address`.
  Hdf5Object object(std::uint64_t address);

  /// @param type  0 for groups, 1 for chunks.
  /// @param parent_level  level of the node that refers to this one; nothing for the root.
  /// @throws InputError unless the node is one level below its parent, which prevents cycles.
  Hdf5TreeNode tree_node(std::uint64_t address, std::uint64_t type,
                         std::optional<std::uint64_t> parent_level) const;

  /// Counts one entry of any table, at most a million per file.
  /// @param piece  for the message.
  void count_entry(const Hdf5Piece& piece);
  /// Counts `size` bytes of numbers read, at most 128 MiB per file.
  void count_bytes(std::uint64_t size, const Hdf5Piece& piece);

 private:
  std::uint64_t symbol_table_root(Hdf5Piece& piece);
  std::uint64_t plain_root(Hdf5Piece& piece);
  void read_messages(Hdf5Piece block, int version, int header_flags, Hdf5Object& object,
                     std::vector<Hdf5Piece>& continuations);

  const std::string& bytes_;
  std::size_t start_;
  const std::string& path_;
  std::uint64_t root_ = 0;
  std::uint64_t entries_ = 0;
  std::uint64_t read_bytes_ = 0;
};

}  // namespace swarmcert::files
