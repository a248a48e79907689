#include "nn/weights/safetensors.h"

#include <algorithm>
#include <cstring>
#include <numeric>

#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/base/json.h"
#include "nn/base/text.h"
#include "nn/weights/activation.h"
#include "nn/weights/layer_names.h"
#include "nn/weights/tensors.h"

namespace swarmcert::files {
namespace {

constexpr std::uint64_t kLargestHeader_bytes = std::uint64_t{4} << 20;
/// Key in "__metadata__" for the names of our layers in order of evaluation; safetensors does not define an order.
constexpr char kOrderKey[] = "swarmcert.layers";
constexpr char kActivationKey[] = "activation";

std::uint64_t header_length(const std::string& bytes) {
  std::uint64_t length = 0;
  std::memcpy(&length, bytes.data(), sizeof length);
  return length;
}

struct Entry {
  DeclaredTensor tensor;
  std::uint64_t begin = 0, end = 0;  ///< in the data after the header
};

class Reader {
 public:
  Reader(const std::string& bytes, const std::string& path, const LayerChoice& choice)
      : path_(path), choice_(choice) {
    if (bytes.size() < 8) refuse("", "", "is shorter than a safetensors header", kCopyAgain);
    const std::uint64_t length = header_length(bytes);
    if (length > bytes.size() - 8 || length > kLargestHeader_bytes) {
      refuse("", std::to_string(length) + " bytes", "the header is longer than the file or than 4 MiB",
             kCopyAgain);
    }
    header_ = parse_json(bytes.substr(8, length), path);
    data_ = std::string_view(bytes).substr(8 + length);
  }

  Weights run() {
    for (const auto& [name, value] : header_.items()) {
      if (name != "__metadata__") entries_.push_back(entry(name, value));
    }
    check_layout();
    std::vector<std::string> notes = read_metadata();
    const Listing listing = sort_by_layer();
    std::vector<DeclaredTensor> tensors;
    for (const Entry& entry : entries_) tensors.push_back(entry.tensor);
    const TensorReader read = [this](std::size_t i) {
      const Entry& entry = entries_[i];
      const Precision precision = *entry.tensor.precision;
      const std::uint64_t count = (entry.end - entry.begin) / width(precision);
      std::vector<double> numbers;
      numbers.reserve(count);
      append_numbers(data_.data() + entry.begin, count, 1, precision, numbers);
      return numbers;
    };
    Weights weights = assemble(tensors, read, path_, listing, choice_);
    weights.notes.insert(weights.notes.end(), notes.begin(), notes.end());
    weights.unused.insert(weights.unused.end(), unused_.begin(), unused_.end());
    if (activation_.empty()) return weights;
    return with_activation_of_file(std::move(weights), listed_activations(activation_),
                                   std::string("__metadata__.") + kActivationKey);
  }

 private:
  [[noreturn]] void refuse(const std::string& field, const std::string& value, const std::string& what,
                           const std::string& hint = "") const {
    throw InputError({path_, "", field, value, what, hint});
  }

  Entry entry(const std::string& name, const Json& value) const {
    const std::string field = in_quotes(name);
    if (!value.is_object()) refuse(field, "", "the header of a tensor is not an object");
    for (const auto& item : value.items()) {
      const std::string& key = item.key();
      if (key != "dtype" && key != "shape" && key != "data_offsets")
        refuse(field, in_quotes(key), "is not a known key");
    }
    if (!value.contains("dtype") || !value["dtype"].is_string()) refuse(field, "", "has no dtype");
    Entry entry;
    entry.tensor.name = name;
    entry.tensor.type = value["dtype"].get<std::string>();
    if (entry.tensor.type == "F32") entry.tensor.precision = Precision::kFloat32;
    if (entry.tensor.type == "F64") entry.tensor.precision = Precision::kFloat64;
    if (entry.tensor.type == "F16") entry.tensor.precision = Precision::kFloat16;
    if (entry.tensor.type == "BF16") entry.tensor.precision = Precision::kBfloat16;
    entry.tensor.shape = counts(value, field, "shape");
    const std::vector<std::uint64_t> offsets = counts(value, field, "data_offsets");
    if (offsets.size() != 2 || offsets[0] > offsets[1] || offsets[1] > data_.size()) {
      refuse(field + ".data_offsets", shape_text(offsets),
             "is not a range in the " + std::to_string(data_.size()) + " bytes of data", kCopyAgain);
    }
    entry.begin = offsets[0];
    entry.end = offsets[1];
    if (!entry.tensor.precision) return entry;
    const std::optional<std::uint64_t> count = element_count(entry.tensor.shape);
    if (!count || *count * width(*entry.tensor.precision) != entry.end - entry.begin) {
      refuse(field + ".shape", shape_text(entry.tensor.shape),
             "does not fit the " + std::to_string(entry.end - entry.begin) + " bytes of its data",
             kCopyAgain);
    }
    return entry;
  }

  std::vector<std::uint64_t> counts(const Json& value, const std::string& field, const char* key) const {
    const std::string whole = field + "." + key;
    if (!value.contains(key) || !value[key].is_array()) refuse(whole, "", "is not a list");
    std::vector<std::uint64_t> result;
    for (const Json& number : value[key]) {
      if (!number.is_number_unsigned())
        refuse(whole, "", "holds something that is not a non-negative integer");
      result.push_back(number.get<std::uint64_t>());
      if (result.size() > 8) refuse(whole, "", "has more than 8 entries");
    }
    return result;
  }

  /// The format requires that tensors cover the data without overlaps or gaps.
  void check_layout() const {
    std::vector<const Entry*> by_begin;
    for (const Entry& entry : entries_) by_begin.push_back(&entry);
    std::sort(by_begin.begin(), by_begin.end(), [](const Entry* a, const Entry* b) {
      return std::make_pair(a->begin, a->end) < std::make_pair(b->begin, b->end);
    });
    std::uint64_t covered = 0;
    for (const Entry* entry : by_begin) {
      if (entry->begin != covered) {
        refuse(in_quotes(entry->tensor.name) + ".data_offsets", shape_text({entry->begin, entry->end}),
               entry->begin < covered ? "overlaps another tensor" : "leaves a gap before it", kCopyAgain);
      }
      covered = entry->end;
    }
    if (covered != data_.size())
      refuse("", std::to_string(data_.size() - covered) + " bytes", "belong to no tensor");
  }

  /// Adds the tensors that __metadata__ says equal a stored one: the library stores tied tensors once and names the
  /// copies there, {"4.weight": "2.weight"}. Other entries say who wrote the file and are named as unused.
  std::vector<std::string> read_metadata() {
    std::vector<std::string> notes;
    if (!header_.contains("__metadata__")) return notes;
    const Json& metadata = header_["__metadata__"];
    if (!metadata.is_object()) refuse("__metadata__", "", "is not an object");
    const auto stored = [this](const std::string& name) {
      return std::find_if(entries_.begin(), entries_.end(),
                          [&name](const Entry& entry) { return entry.tensor.name == name; });
    };
    for (const auto& [name, value] : metadata.items()) {
      if (name == kOrderKey) continue;
      const std::string field = "__metadata__." + name;
      if (!value.is_string()) refuse(field, "", "is not text");
      const std::string target = value.get<std::string>();
      if (name == kActivationKey) {
        activation_ = target;
        continue;
      }
      const auto source = stored(target);
      const bool is_tensor = ends_with(name, ".weight") || ends_with(name, ".bias");
      if (source == entries_.end()) {
        if (is_tensor)
          refuse(field, in_quotes(target), "names a tied tensor, and the file holds no such tensor",
                 "save the whole state dict with safetensors.torch.save_model");
        unused_.push_back(field + ": describes the file");
        continue;
      }
      if (stored(name) != entries_.end())
        refuse(field, in_quotes(target), "ties a tensor that the file also stores");
      Entry copy = *source;
      copy.tensor.name = name;
      entries_.push_back(std::move(copy));
      notes.push_back(name + " is " + target + ", to which it is tied");
    }
    return notes;
  }

  /// Sorts our own files into the stated order of evaluation, and other files by name.
  Listing sort_by_layer() {
    const std::vector<std::string> order = layer_order();
    const auto layer_of = [](const std::string& tensor) {
      const std::size_t dot = tensor.rfind('.');
      return dot == std::string::npos ? std::string() : tensor.substr(0, dot);
    };
    const auto rank = [&](const Entry& entry) {
      return std::find(order.begin(), order.end(), layer_of(entry.tensor.name)) - order.begin();
    };
    std::vector<std::size_t> indices(entries_.size());
    std::iota(indices.begin(), indices.end(), std::size_t{0});
    std::vector<std::ptrdiff_t> ranks;
    for (const Entry& entry : entries_) ranks.push_back(rank(entry));
    std::sort(indices.begin(), indices.end(), [&](std::size_t a, std::size_t b) {
      if (ranks[a] != ranks[b]) return ranks[a] < ranks[b];
      return naturally_before(entries_[a].tensor.name, entries_[b].tensor.name);
    });
    std::vector<Entry> sorted;
    sorted.reserve(entries_.size());
    for (const std::size_t i : indices) sorted.push_back(entries_[i]);
    entries_ = std::move(sorted);
    const bool is_stated = std::none_of(ranks.begin(), ranks.end(), [&order](std::ptrdiff_t rank_in_order) {
      return rank_in_order == static_cast<std::ptrdiff_t>(order.size());
    });
    return is_stated ? Listing::kEvaluation : Listing::kUnordered;
  }

  /// Returns the stated order, or nothing if the file does not state one.
  std::vector<std::string> layer_order() const {
    if (!header_.contains("__metadata__") || !header_["__metadata__"].contains(kOrderKey)) return {};
    const Json& metadata = header_["__metadata__"];
    const std::string field = std::string("__metadata__.") + kOrderKey;
    if (!metadata[kOrderKey].is_string()) refuse(field, "", "is not text");
    const Json names = parse_json(metadata[kOrderKey].get<std::string>(), path_ + ": " + field);
    if (!names.is_array() || names.size() > 4096) refuse(field, "", "is not a list of layers");
    std::vector<std::string> order;
    for (const Json& name : names) {
      if (!name.is_string()) refuse(field, "", "is not a list of layers");
      order.push_back(name.get<std::string>());
    }
    return order;
  }

  const std::string& path_;
  const LayerChoice& choice_;
  Json header_;
  std::string_view data_;
  std::vector<Entry> entries_;
  std::vector<std::string> unused_;
  std::string activation_;  ///< as stated in __metadata__
};

}  // namespace

bool looks_like_safetensors(const std::string& bytes) {
  return bytes.size() >= 10 && header_length(bytes) <= kLargestHeader_bytes && bytes[8] == '{';
}

Weights parse_safetensors(const std::string& bytes, const std::string& path, const LayerChoice& choice) {
  return Reader(bytes, path, choice).run();
}

std::string safetensors_bytes(const Weights& weights) {
  if (!weights.is_relu())
    throw InputError({weights.path, "", "activation", in_quotes(weights.activation_names()),
                      "cannot be stated by this format", "write ReLU networks only"});
  Json header = Json::object();
  Json names = Json::array();
  for (const Layer& layer : weights.layers) names.push_back(layer.name);
  header["__metadata__"] = {{kOrderKey, names.dump(-1, ' ', false, Json::error_handler_t::ignore)}};
  std::string data;
  const auto append = [&](const std::string& name, const std::vector<double>& numbers, const Json& shape) {
    const std::size_t begin = data.size();
    for (const double number : numbers) {
      const auto narrow = static_cast<float>(number);
      const bool is_narrow = weights.precision == Precision::kFloat32;
      const char* const raw =
          is_narrow ? reinterpret_cast<const char*>(&narrow) : reinterpret_cast<const char*>(&number);
      data.append(raw, width(weights.precision));
    }
    header[name] = {{"dtype", weights.precision == Precision::kFloat32 ? "F32" : "F64"},
                    {"shape", shape},
                    {"data_offsets", {begin, data.size()}}};
  };
  for (const Layer& layer : weights.layers) {
    append(tensor_name(layer, "weight"), layer.weights, {layer.outputs, layer.inputs});
    append(tensor_name(layer, "bias"), layer.biases, Json::array({layer.outputs}));
  }
  std::string text;
  try {
    text = header.dump();
  } catch (const Json::type_error&) {
    throw InputError({weights.path, "", "", "", "the name of a layer is not UTF-8", "rename the layers"});
  }
  text.resize((text.size() + 7) / 8 * 8, ' ');  // aligns the numbers to multiples of 8 bytes
  const std::uint64_t length = text.size();
  return std::string(reinterpret_cast<const char*>(&length), sizeof length) + text + data;
}

void save_safetensors(const Weights& weights, const std::string& path, bool overwrite) {
  write_file(path, safetensors_bytes(weights), overwrite);
}

}  // namespace swarmcert::files
