#include "nn/weights/pth.h"

#include <algorithm>
#include <map>
#include <memory>
#include <set>

#include "nn/base/input_error.h"
#include "nn/weights/activation.h"
#include "nn/weights/keras.h"
#include "nn/weights/layer_names.h"
#include "nn/weights/pickle.h"
#include "nn/weights/policy_archive.h"
#include "nn/weights/state_dict.h"
#include "nn/weights/tensors.h"
#include "nn/weights/zip_archive.h"

namespace swarmcert::files {
namespace {

using Kind = PickledValue::Kind;

constexpr std::uint64_t kLargestPickle_bytes = std::uint64_t{16} << 20;
/// PROTO, LONG1 of ten bytes, 0x1950a86a20f9469cfc6c, STOP. The byte after PROTO is the pickle protocol.
constexpr std::string_view kLegacyMagic("\x8a\x0a\x6c\xfc\x9c\x46\xf9\x20\x6a\xa8\x50\x19.", 13);

/// Returns the raw bytes of the storage with this key.
using StorageBytes = std::function<std::string_view(const PickledStorage&, Precision)>;

std::optional<Precision> precision_of(std::string_view storage_type) {
  if (storage_type == "FloatStorage") return Precision::kFloat32;
  if (storage_type == "DoubleStorage") return Precision::kFloat64;
  if (storage_type == "HalfStorage") return Precision::kFloat16;
  if (storage_type == "BFloat16Storage") return Precision::kBfloat16;
  return std::nullopt;
}

/// Returns true if every entry of the view lies inside its storage.
bool lies_inside(const PickledTensor& tensor, std::uint64_t elements) {
  std::uint64_t last = tensor.offset;
  for (std::size_t d = 0; d < tensor.sizes.size(); ++d) {
    std::uint64_t step;
    if (tensor.sizes[d] == 0) return true;
    if (__builtin_mul_overflow(tensor.sizes[d] - 1, tensor.strides[d], &step)) return false;
    if (__builtin_add_overflow(last, step, &last)) return false;
  }
  return last < elements;
}

/// Returns the row-major numbers of a view of one or two dimensions.
std::vector<double> numbers_of(const PickledTensor& tensor, std::string_view storage, Precision precision) {
  const bool is_matrix = tensor.sizes.size() == 2;
  const std::uint64_t rows = is_matrix ? tensor.sizes[0] : 1;
  const std::uint64_t row_stride = is_matrix ? tensor.strides[0] : 0;
  std::vector<double> numbers;
  numbers.reserve(rows * tensor.sizes.back());
  for (std::uint64_t i = 0; i < rows; ++i) {
    const std::uint64_t first = tensor.offset + i * row_stride;
    append_numbers(storage.data() + first * width(precision), tensor.sizes.back(), tensor.strides.back(),
                   precision, numbers);
  }
  return numbers;
}

/// Returns what the module list says about the function and the tensors do not: a numbered module without tensors
/// that comes after the last layer, as a final Tanh() in a Sequential does.
std::optional<std::string> module_behind(const StateDict& dict, const std::string& last) {
  const std::string container = last.substr(0, last.rfind('.') + 1);  // npos + 1 is 0
  for (const std::string& module : dict.modules) {
    const bool is_beside = module.compare(0, container.size(), container) == 0 &&
                           module.find('.', container.size()) == std::string::npos;
    const bool holds_tensors =
        std::any_of(dict.tensors.begin(), dict.tensors.end(),
                    [&module](const auto& tensor) { return has_prefix(tensor.first, module + "."); });
    if (is_beside && !holds_tensors && numbered_before(last, module)) return module;
  }
  return std::nullopt;
}

Weights assemble_state_dict(const Pickle& pickle, const StorageBytes& bytes_of, const std::string& path,
                            const std::string& key, const LayerChoice& choice) {
  const StateDict dict = select_state_dict(pickle, key, path);
  const auto& entries = dict.tensors;
  std::vector<DeclaredTensor> declared;
  for (const auto& [name, index] : entries) {
    const PickledTensor& tensor = pickle.tensors[index];
    const std::string_view type = pickle.storages[tensor.storage].type;
    declared.push_back({name, precision_of(type), "torch." + std::string(type), tensor.sizes});
  }
  const TensorReader read = [&](std::size_t i) {
    const PickledTensor& tensor = pickle.tensors[entries[i].second];
    const PickledStorage& storage = pickle.storages[tensor.storage];
    const std::optional<std::uint64_t> count = element_count(tensor.sizes);
    if (!count || *count > storage.elements || !lies_inside(tensor, storage.elements)) {
      throw InputError({path, "", entries[i].first, shape_text(tensor.sizes),
                        "the view (offset " + std::to_string(tensor.offset) + ", strides " +
                            shape_text(tensor.strides) + ") does not fit its storage of " +
                            std::to_string(storage.elements) + " numbers",
                        "save contiguous copies: {k: v.clone() for k, v in model.state_dict().items()}"});
    }
    const Precision precision = *precision_of(storage.type);
    return numbers_of(tensor, storage.is_inline ? storage.bytes : bytes_of(storage, precision), precision);
  };
  Weights weights = assemble(declared, read, path, Listing::kRegistration, choice);
  if (!dict.key.empty())
    weights.notes.push_back("the state dict is " + in_quotes(dict.key) + ", the only one in the file");
  weights.unused.insert(weights.unused.end(), dict.unused.begin(), dict.unused.end());
  if (const std::optional<std::string> module = module_behind(dict, weights.layers.back().name))
    weights.assumed.push_back(kEndGuess + ("nothing, but the file lists the module " + in_quotes(*module)) +
                              " there; --activation names one more activation for it, or linear");
  return weights;
}

[[noreturn]] void refuse_storage_size(const std::string& path, const PickledStorage& storage,
                                      std::uint64_t found) {
  throw InputError({path, "", "storage " + in_quotes(storage.key), std::to_string(found) + " bytes",
                    std::to_string(storage.elements) + " numbers were declared", kCopyAgain});
}

/// Returns the archive's only top-level folder, which is named after the file that torch.save was given.
std::string top_folder(const ZipArchive& archive, const std::string& path) {
  for (const std::string& name : archive.names()) {
    const std::size_t slash = name.find('/');
    if (slash != std::string::npos && name.compare(slash, std::string::npos, "/data.pkl") == 0) {
      return name.substr(0, slash + 1);
    }
  }
  throw InputError({path, "", "", "",
                    "the zip archive has no <folder>/data.pkl, so torch.save did not write it",
                    "save it with torch.save(model.state_dict(), ...)"});
}

void refuse_other_archives(const ZipArchive& archive, const std::string& folder, const std::string& path) {
  const std::string code = folder + "code/";
  for (const std::string& name : archive.names()) {
    if (name == folder + "constants.pkl" || name.compare(0, code.size(), code) == 0) {
      throw InputError({path, "", name, "", "the archive is a TorchScript program, not a state dict",
                        "save the weights alone: torch.save(model.state_dict(), ...)"});
    }
  }
  if (archive.has(folder + "byteorder") && archive.read(folder + "byteorder", 16) != "little") {
    throw InputError({path, "", folder + "byteorder", "", "the numbers are not little-endian",
                      "load and save the file again on a little-endian machine"});
  }
}

/// The legacy container split into its pickles and its raw data.
class Legacy {
 public:
  Legacy(const std::string& bytes, const std::string& path) : bytes_(bytes), path_(path) {
    std::size_t at = 2 + kLegacyMagic.size();
    const Pickle version = parse_pickle(bytes_, at, path_, "protocol version");
    const PickledValue& number = version.values[version.root];
    if (number.kind != Kind::kInteger || number.integer != 1001) {
      throw InputError({path_, "offset " + std::to_string(at), "protocol version", "", "must be 1001", ""});
    }
    const Pickle system = parse_pickle(bytes_, version.end, path_, "system information");
    refuse_big_endian(system);
    state = parse_pickle(bytes_, system.end, path_, "");
    const Pickle keys = parse_pickle(bytes_, state.end, path_, "list of storages");
    const PickledValue& list = keys.values[keys.root];
    if (list.kind != Kind::kList)
      throw InputError({path_, "", "list of storages", "", "is not a list", kCopyAgain});
    for (const std::uint32_t item : list.items) keys_.push_back(keys.values[item].text);
    data_at_ = keys.end;
  }

  /// Locates the raw data, which are stored in the order of the list, each preceded by its number of elements. The
  /// element size is known only from the declaration of a tensor, so all storages must be visited.
  std::map<std::string_view, std::string_view> locate() const {
    std::map<std::string_view, const PickledStorage*> declared;
    for (const PickledStorage& storage : state.storages) {
      if (storage.is_inline) continue;
      const auto [entry, is_new] = declared.emplace(storage.key, &storage);
      if (!is_new && (entry->second->type != storage.type || entry->second->elements != storage.elements)) {
        throw InputError(
            {path_, "", "storage " + in_quotes(storage.key), "", "is declared inconsistently", kCopyAgain});
      }
    }
    std::map<std::string_view, std::string_view> located;
    std::string_view rest = std::string_view(bytes_).substr(data_at_);
    for (const std::string_view key : keys_) {
      const auto found = declared.find(key);
      if (found == declared.end()) {
        throw InputError({path_, "", "storage " + in_quotes(key), "", "belongs to no tensor", kCopyAgain});
      }
      const PickledStorage& storage = *found->second;
      const std::uint64_t bytes_each = element_bytes(storage);
      std::uint64_t count = 0;
      if (rest.size() >= 8) {
        for (std::size_t i = 8; i-- > 0;) count = count << 8 | static_cast<unsigned char>(rest[i]);
        rest.remove_prefix(8);
      }
      if (count != storage.elements || count > rest.size() / bytes_each)
        refuse_storage_size(path_, storage, rest.size());
      located[key] = rest.substr(0, count * bytes_each);
      rest.remove_prefix(count * bytes_each);
    }
    return located;
  }

  Pickle state;

 private:
  std::uint64_t element_bytes(const PickledStorage& storage) const {
    static const std::map<std::string_view, std::uint64_t> kBytes = {
        {"FloatStorage", 4}, {"DoubleStorage", 8}, {"HalfStorage", 2},  {"BFloat16Storage", 2},
        {"LongStorage", 8},  {"IntStorage", 4},    {"ShortStorage", 2}, {"CharStorage", 1},
        {"ByteStorage", 1},  {"BoolStorage", 1}};
    const auto found = kBytes.find(storage.type);
    if (found != kBytes.end()) return found->second;
    throw InputError({path_, "", "storage " + in_quotes(storage.key), "torch." + std::string(storage.type),
                      "numbers of this type cannot be skipped",
                      "save the weights alone as float32 or float64"});
  }

  void refuse_big_endian(const Pickle& system) const {
    const PickledValue& dict = system.values[system.root];
    for (std::size_t i = 0; dict.kind == Kind::kDict && i + 1 < dict.items.size(); i += 2) {
      const PickledValue& value = system.values[dict.items[i + 1]];
      if (system.values[dict.items[i]].text == "little_endian" && value.kind == Kind::kBool &&
          value.integer == 1)
        return;
    }
    throw InputError({path_, "", "little_endian", "", "the numbers are not little-endian",
                      "load and save the file again on a little-endian machine"});
  }

  const std::string& bytes_;
  const std::string& path_;
  std::vector<std::string_view> keys_;
  std::size_t data_at_ = 0;
};

}  // namespace

bool looks_like_pth_zip(const std::string& bytes) {
  return bytes.compare(0, 4, "PK\3\4") == 0 || bytes.compare(0, 4, "PK\5\6") == 0;
}

bool looks_like_pth_legacy(const std::string& bytes) {
  return bytes.size() > 2 && bytes[0] == '\x80' && bytes.compare(2, kLegacyMagic.size(), kLegacyMagic) == 0;
}

Weights parse_pth_zip(const std::string& bytes, const std::string& path, const std::string& key,
                      const LayerChoice& choice) {
  const ZipArchive archive(bytes, path);
  if (is_policy_archive(archive)) return parse_policy_archive(archive, path, key, choice);
  if (is_keras_archive(archive)) return parse_keras_archive(archive, path, choice);
  const std::string folder = top_folder(archive, path);
  refuse_other_archives(archive, folder, path);
  const std::string program = archive.read(folder + "data.pkl", kLargestPickle_bytes);
  const Pickle pickle = parse_pickle(program, 0, path, folder + "data.pkl");

  std::map<std::string_view, std::string> storages;  // read only once, since tensors may share them
  std::uint64_t bytes_read = 0;
  const StorageBytes bytes_of = [&](const PickledStorage& storage, Precision precision) -> std::string_view {
    auto found = storages.find(storage.key);
    if (found == storages.end()) {
      const std::string entry = folder + "data/" + std::string(storage.key);
      found = storages.emplace(storage.key, archive.read(entry, kMostElements * 8 - bytes_read)).first;
      bytes_read += found->second.size();
    }
    const std::string& contents = found->second;
    if (contents.size() % width(precision) != 0 || contents.size() / width(precision) != storage.elements) {
      refuse_storage_size(path, storage, contents.size());
    }
    return contents;
  };
  return assemble_state_dict(pickle, bytes_of, path, key, choice);
}

Weights parse_pth_legacy(const std::string& bytes, const std::string& path, const std::string& key,
                         const LayerChoice& choice) {
  const Legacy container(bytes, path);
  std::optional<std::map<std::string_view, std::string_view>> storages;  // located after checking the names
  const StorageBytes bytes_of = [&](const PickledStorage& storage, Precision) {
    if (!storages) storages = container.locate();
    const auto found = storages->find(storage.key);
    if (found == storages->end()) refuse_storage_size(path, storage, 0);
    return found->second;
  };
  return assemble_state_dict(container.state, bytes_of, path, key, choice);
}

}  // namespace swarmcert::files
