/// @file Writes valid and damaged files in PyTorch's formats, since no .pth files are part of the project.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace swarmcert::tests {

/// Returns `value` as little-endian bytes.
inline std::string little_endian(std::uint64_t value, int width) {
  std::string bytes;
  for (int i = 0; i < width; ++i) bytes += static_cast<char>(value >> (8 * i) & 0xff);
  return bytes;
}

/// Returns raw little-endian numbers as they appear in a storage.
template <typename Scalar>
std::string raw_numbers(const std::vector<Scalar>& numbers) {
  return std::string(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Scalar));
}

// --- pickle opcodes, protocol 2; concatenate them

inline std::string text_op(const std::string& text) { return "X" + little_endian(text.size(), 4) + text; }
inline std::string integer_op(std::int64_t value) {
  return "\x8a\x08" + little_endian(static_cast<std::uint64_t>(value), 8);
}
inline std::string global_op(const std::string& module, const std::string& name) {
  return "c" + module + "\n" + name + "\n";
}
inline std::string tuple_op(const std::vector<std::int64_t>& integers) {
  std::string ops = "(";
  for (const std::int64_t integer : integers) ops += integer_op(integer);
  return ops + "t";
}
inline std::string ordered_dict_op(const std::vector<std::pair<std::string, std::string>>& items) {
  std::string ops = global_op("collections", "OrderedDict") + ")R(";
  for (const auto& [key, value] : items) ops += text_op(key) + value;
  return ops + "u";
}
inline std::string pickle(const std::string& ops) { return "\x80\x02" + ops + "."; }

/// A tensor as declared by torch.save.
struct TensorSpec {
  std::string name;
  std::string key;  ///< of its storage
  std::int64_t elements = 0;
  std::vector<std::int64_t> sizes, strides;
  std::int64_t offset = 0;
  std::string type = "FloatStorage";
  bool is_parameter = false;
};

inline std::string storage_op(const TensorSpec& tensor, bool legacy) {
  return "(" + text_op("storage") + global_op("torch", tensor.type) + text_op(tensor.key) + text_op("cpu") +
         integer_op(tensor.elements) + (legacy ? "N" : "") + "tQ";
}
inline std::string tensor_op(const TensorSpec& tensor, bool legacy) {
  const std::string hooks = ordered_dict_op({});
  std::string ops = global_op("torch._utils", "_rebuild_tensor_v2") + "(" + storage_op(tensor, legacy) +
                    integer_op(tensor.offset) + tuple_op(tensor.sizes) + tuple_op(tensor.strides) + "\x89" +
                    hooks + "tR";
  if (!tensor.is_parameter) return ops;
  return global_op("torch._utils", "_rebuild_parameter") + "(" + ops + "\x88" + hooks + "tR";
}
inline std::string state_dict_op(const std::vector<TensorSpec>& tensors, bool legacy) {
  std::vector<std::pair<std::string, std::string>> items;
  items.reserve(tensors.size());
  for (const TensorSpec& tensor : tensors) items.emplace_back(tensor.name, tensor_op(tensor, legacy));
  return ordered_dict_op(items);
}

// --- zip

struct ZipEntry {
  std::string name;
  std::string contents;
  int method = 0;              ///< 0: stored, 8: deflated (the contents are taken as they are)
  std::int64_t declared = -1;  ///< uncompressed size in the headers; -1: the true one
};

inline std::uint32_t crc32(const std::string& bytes) {
  std::uint32_t crc = 0xffffffffu;
  for (const char c : bytes) {
    crc ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (0xedb88320u & (0u - (crc & 1u)));
  }
  return ~crc;
}

inline std::string zip(const std::vector<ZipEntry>& entries) {
  std::string bytes;
  std::string directory;
  for (const ZipEntry& entry : entries) {
    const std::uint64_t declared =
        entry.declared < 0 ? entry.contents.size() : static_cast<std::uint64_t>(entry.declared);
    const std::string common = little_endian(20, 2) + little_endian(0, 2) +
                               little_endian(static_cast<std::uint64_t>(entry.method), 2) +
                               little_endian(0, 4) + little_endian(crc32(entry.contents), 4) +
                               little_endian(entry.contents.size(), 4) + little_endian(declared, 4) +
                               little_endian(entry.name.size(), 2) + little_endian(0, 2);
    directory += "PK\1\2" + little_endian(20, 2) + common + std::string(10, '\0') +
                 little_endian(bytes.size(), 4) + entry.name;
    bytes += "PK\3\4" + common + entry.name + entry.contents;
  }
  return bytes + directory + "PK\5\6" + little_endian(0, 4) + little_endian(entries.size(), 2) +
         little_endian(entries.size(), 2) + little_endian(directory.size(), 4) +
         little_endian(bytes.size(), 4) + little_endian(0, 2);
}

// --- whole files

/// Key and raw bytes of each storage, in the order of the list in a legacy file.
using Storages = std::vector<std::pair<std::string, std::string>>;

inline std::string zip_file(const std::string& program, const Storages& storages,
                            const std::vector<ZipEntry>& more = {}) {
  std::vector<ZipEntry> entries = {{"archive/data.pkl", program}};
  for (const auto& [key, raw] : storages) entries.push_back({"archive/data/" + key, raw});
  entries.push_back({"archive/version", "3\n"});
  entries.insert(entries.end(), more.begin(), more.end());
  return zip(entries);
}
inline std::string zip_file(const std::vector<TensorSpec>& tensors, const Storages& storages) {
  return zip_file(pickle(state_dict_op(tensors, false)), storages);
}

inline std::string legacy_file(const std::string& program, const Storages& storages, std::size_t bytes_each,
                               bool little = true) {
  std::string keys = "](";
  std::string data;
  for (const auto& [key, raw] : storages) {
    keys += text_op(key);
    data += little_endian(raw.size() / bytes_each, 8) + raw;
  }
  const std::string magic("\x80\x02\x8a\x0a\x6c\xfc\x9c\x46\xf9\x20\x6a\xa8\x50\x19.", 15);
  const std::string system = "}(" + text_op("protocol_version") + integer_op(1001) +
                             text_op("little_endian") + (little ? "\x88" : "\x89") + "u";
  return magic + pickle(integer_op(1001)) + pickle(system) + program + pickle(keys + "e") + data;
}
inline std::string legacy_file(const std::vector<TensorSpec>& tensors, const Storages& storages,
                               std::size_t bytes_each) {
  return legacy_file(pickle(state_dict_op(tensors, true)), storages, bytes_each);
}

// --- the example used by most tests: 2 inputs, 3 hidden units, 1 output

inline std::vector<TensorSpec> small_tensors(const std::string& type = "FloatStorage") {
  return {{"fc1.weight", "0", 6, {3, 2}, {2, 1}, 0, type},
          {"fc1.bias", "1", 3, {3}, {1}, 0, type},
          {"fc2.weight", "2", 3, {1, 3}, {3, 1}, 0, type},
          {"fc2.bias", "3", 1, {1}, {1}, 0, type}};
}
template <typename Scalar>
Storages small_storages() {
  return {{"0", raw_numbers<Scalar>({1, -2, Scalar(0.5), 3, Scalar(-0.25), 4})},
          {"1", raw_numbers<Scalar>({Scalar(0.125), 0, -1})},
          {"2", raw_numbers<Scalar>({1, 2, -3})},
          {"3", raw_numbers<Scalar>({Scalar(0.75)})}};
}
inline std::string small_zip() { return zip_file(small_tensors(), small_storages<float>()); }
inline std::string small_legacy() {
  return legacy_file(small_tensors("DoubleStorage"), small_storages<double>(), sizeof(double));
}

}  // namespace swarmcert::tests
