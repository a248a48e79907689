/// @file Reads pickled state dicts as plain data. Nothing in a pickle is executed.
///
/// Python's unpickler runs whatever a file names. This reader knows the opcodes, torch's tensors, NumPy's arrays and
/// the names of types that hold settings, such as argparse.Namespace, pathlib.Path and those of Stable-Baselines3 and
/// gymnasium, of whose objects it keeps the state alone. It rejects every other name with its offset. It does not
/// recurse, and its memory is bounded by kMostPickleOperations.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace swarmcert::files {

/// Maximum number of opcodes before a pickle is rejected; a four-layer network needs two hundred.
inline constexpr std::size_t kMostPickleOperations = 1'000'000;

/// Raw numbers to which tensors are views. The string views point into the parsed bytes.
struct PickledStorage {
  std::string_view type;  ///< torch's name: "FloatStorage"
  std::string_view key;   ///< raw data of the file: an archive entry, or an entry of the legacy list
  std::uint64_t elements;
  bool is_inline = false;       ///< a NumPy array: its numbers are in the pickle itself
  std::string_view bytes = {};  ///< if `is_inline`
};

/// A strided view: entry (i, j, ...) is storage[offset + i strides[0] + j strides[1] + ...]. As declared: the sizes and
/// the offset have not been checked against the storage.
struct PickledTensor {
  std::size_t storage;  ///< index into Pickle::storages
  std::uint64_t offset;
  std::vector<std::uint64_t> sizes, strides;
};

struct PickledValue {
  enum class Kind : std::uint8_t {
    kNone,
    kBool,
    kInteger,
    kReal,
    kText,
    kTuple,
    kList,
    kDict,
    kGlobal,
    kStorageType,
    kStorage,
    kTensor,
    kBytes,
    kNumberType,  ///< numpy.dtype: `text` is "f4", `integer` 1 if big-endian
    kArray,       ///< a NumPy array whose numbers have not been set
    kOpaque       ///< an object that is passed over, or an integer of more than 64 bits
  };
  Kind kind = Kind::kNone;
  std::int64_t integer = 0;  ///< kBool, kInteger: the value; kStorage, kTensor: index into Pickle's tables
  std::string_view text;     ///< kText, kBytes, kStorageType; points into the parsed bytes or Pickle::decoded
  std::vector<std::uint32_t>
      items;  ///< kTuple, kList: indices into Pickle::values; kDict: key, value, key, ...; kOpaque: its state, if any
  std::optional<std::uint32_t> attributes =
      {};           ///< of a kDict: what is set on the object itself, as torch's _metadata
  double real = 0;  ///< kReal
};

/// One pickle. Values refer to each other by index and may form cycles, so do not recurse over them.
struct Pickle {
  std::vector<PickledValue> values;
  std::vector<PickledStorage> storages;
  std::vector<PickledTensor> tensors;
  std::deque<std::string> decoded;  ///< bytes that the pickle writes as text
  std::uint32_t root = 0;
  std::size_t end = 0;  ///< offset in the parsed bytes just after the STOP opcode
};

/// Parses the pickle that starts at `begin`.
/// @param path, entry  for messages: the file, and the archive entry or part of it that `bytes` holds.
/// @throws InputError with the offset for anything but these opcodes and names.
Pickle parse_pickle(std::string_view bytes, std::size_t begin, const std::string& path,
                    const std::string& entry);

/// Returns "an integer", "a dict", ...: for messages.
const char* name(PickledValue::Kind kind);

}  // namespace swarmcert::files
