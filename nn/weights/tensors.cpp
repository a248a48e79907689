#include "nn/weights/tensors.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <set>

#include "nn/base/input_error.h"
#include "nn/weights/layer_names.h"
#include "nn/weights/parametrized.h"
#include "nn/weights/relu_chain.h"

#if __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error "weight files are little-endian, and append_numbers() copies their bytes as they are"
#endif

namespace swarmcert::files {
namespace {

constexpr char kOnlyLinear[] = "only networks of linear layers with ReLU between them are supported";
constexpr char kFold[] =
    "fold it into the layer before it: torch.nn.utils.fusion.fuse_linear_bn_eval(linear, bn)";
constexpr std::size_t kNone = static_cast<std::size_t>(-1);
constexpr std::size_t kMostTensors = 4096;

/// The tensors of one layer, as indices into the declared tensors.
struct LayerParts {
  std::string name;
  std::size_t weight = kNone;
  std::size_t bias = kNone;
};

/// Returns the names of the layers that have matrices, parametrised or not.
std::vector<std::string> layers_in(const std::vector<DeclaredTensor>& tensors) {
  std::vector<std::string> layers;
  for (const DeclaredTensor& tensor : tensors) {
    if (tensor.shape.size() != 2) continue;
    const std::string name = tensor.name.substr(0, tensor.name.find(".parametrizations."));
    const std::size_t end = name.size() < tensor.name.size() ? name.size() : name.rfind('.');
    if (end != name.size() && name.compare(end + 1, 6, "weight") != 0) continue;  // npos + 1 is 0
    layers.push_back(end == std::string::npos ? "" : name.substr(0, end));
  }
  return layers;
}

/// The hint for a tensor that is of no layer: a selection of layers or of modules leaves it out.
std::string ways_to_leave_out(const std::vector<std::string>& layers) {
  std::vector<std::string> modules = modules_of(layers);
  if (modules.front().empty()) modules = layers;
  if (modules.empty() || modules.front().empty()) return kOnlyLinear;
  std::string list;
  for (const std::string& module : modules) list += (list.empty() ? "" : ", ") + module;
  return "name the network to certify, which leaves this out, with --select and one of " + list +
         "; or several in the order of evaluation: --select A,B";
}

class Assembler {
 public:
  Assembler(const std::vector<DeclaredTensor>& tensors, const TensorReader& read, const std::string& path,
            Listing listing, const LayerChoice& choice)
      : tensors_(tensors), read_(read), path_(path), listing_(listing), choice_(choice) {}

  Weights run() {
    refuse_other_structures();
    for (std::size_t i = 0; i < tensors_.size(); ++i) find_weight(i);
    for (std::size_t i = 0; i < tensors_.size(); ++i) find_bias(i);
    if (parts_.empty()) {
      throw InputError({path_, "", "", "", "holds no tensor named \"<layer>.weight\"",
                        "save a state dict of a "
                        "network of linear layers"});
    }
    Weights weights;
    LayerOrder order = sort_parts();
    weights.order_source = order.source;
    weights.assumed = std::move(order.assumed);
    if (listing_ != Listing::kEvaluation) weights.activation_source = ActivationSource::kDefault;
    weights.path = path_;
    weights.precision = *tensors_[parts_.front().weight].precision;
    if (width(weights.precision) == 2) {
      weights.notes.push_back(std::string("stored as ") + name(weights.precision) + ", read as float32");
      weights.precision = Precision::kFloat32;
    }
    for (const LayerParts& parts : parts_) weights.layers.push_back(layer(parts));
    return weights;
  }

 private:
  [[noreturn]] void refuse(std::size_t i, const std::string& value, const std::string& what,
                           const std::string& hint = "") const {
    throw InputError({path_, "", tensors_[i].name, value, what, hint});
  }

  /// Rejects tensors that occur only in other kinds of layers, with the name of the kind and a hint.
  void refuse_other_structures() const {
    struct Hint {
      const char* ending;
      const char* kind;
      const char* hint;
    };
    constexpr Hint kHints[] = {
        {"running_mean", "batch normalisation", kFold},
        {"running_var", "batch normalisation", kFold},
        {"num_batches_tracked", "batch normalisation", kFold},
        {"in_proj_weight", "attention", kOnlyLinear},
        {"weight_ih_l0", "a recurrent layer", kOnlyLinear},
        {"weight_hh_l0", "a recurrent layer", kOnlyLinear},
    };
    for (std::size_t i = 0; i < tensors_.size(); ++i) {
      if (tensors_[i].name == "n_averaged")
        refuse(i, shape_text(tensors_[i].shape), "is the count of an AveragedModel, not a weight",
               "save the average itself: torch.save(averaged.module.state_dict(), ...)");
      for (const Hint& hint : kHints) {
        std::string layer;
        if (is_part(i, hint.ending, layer))
          refuse(i, shape_text(tensors_[i].shape),
                 std::string("belongs to ") + hint.kind +
                     ", so the network is not a chain of linear layers and ReLU",
                 hint.hint);
      }
    }
  }

  /// Returns true if the i-th tensor is named "<layer>.<part>" or just "<part>"; sets `layer`.
  bool is_part(std::size_t i, const std::string& part, std::string& layer) const {
    const std::string& name = tensors_[i].name;
    layer.clear();
    if (name == part) return true;
    const std::size_t dot = name.rfind('.');
    if (dot == std::string::npos || name.compare(dot + 1, std::string::npos, part) != 0) return false;
    layer = name.substr(0, dot);
    return true;
  }

  void check_type(std::size_t i) const {
    const DeclaredTensor& tensor = tensors_[i];
    if (!tensor.precision) {
      refuse(i, tensor.type, "weights must be float16, bfloat16, float32 or float64",
             "convert before saving: model.float().state_dict()");
    }
    const DeclaredTensor& first = parts_.empty() ? tensor : tensors_[parts_.front().weight];
    if (tensor.precision != first.precision) {
      refuse(i, name(*tensor.precision),
             first.name + " is " + name(*first.precision) + ", and one file has one type",
             "convert before saving: model.float() or model.double()");
    }
    for (const std::uint64_t size : tensor.shape) {
      if (size == 0) refuse(i, shape_text(tensor.shape), "has a dimension of size 0");
    }
    const std::optional<std::uint64_t> count = element_count(tensor.shape);
    if (!count || *count > kMostElements - elements_in(parts_)) {
      refuse(i, shape_text(tensor.shape),
             "the network has more than " + std::to_string(kMostElements) + " numbers");
    }
  }

  std::uint64_t elements_in(const std::vector<LayerParts>& parts) const {
    std::uint64_t sum = 0;  // only weights: a bias is never larger than its weight
    for (const LayerParts& part : parts) sum += *element_count(tensors_[part.weight].shape);
    return sum;
  }

  void find_weight(std::size_t i) {
    LayerParts parts;
    if (!is_part(i, "weight", parts.name)) return;
    if (tensors_[i].shape.size() != 2) {
      refuse(i, shape_text(tensors_[i].shape),
             "a linear layer's weight has two dimensions, [outputs, inputs]", kOnlyLinear);
    }
    if (!names_.insert(parts.name).second) refuse(i, "", "appears twice");
    check_type(i);
    parts.weight = i;
    parts_.push_back(parts);
  }

  void find_bias(std::size_t i) {
    std::string layer;
    if (is_part(i, "weight", layer)) return;
    if (!is_part(i, "bias", layer)) {
      refuse(i, shape_text(tensors_[i].shape), "is neither the weight nor the bias of a linear layer",
             ways_to_leave_out(layers_in(tensors_)));
    }
    LayerParts* owner = nullptr;
    for (LayerParts& parts : parts_)
      if (parts.name == layer) owner = &parts;
    if (owner == nullptr) {
      refuse(
          i, shape_text(tensors_[i].shape),
          "is a bias without its weight: " + (layer.empty() ? "weight" : layer + ".weight") + " is missing",
          "save the whole state dict of the network");
    }
    if (owner->bias != kNone) refuse(i, "", "appears twice");
    const DeclaredTensor& weight = tensors_[owner->weight];
    if (tensors_[i].shape.size() != 1 || tensors_[i].shape[0] != weight.shape[0]) {
      refuse(i, shape_text(tensors_[i].shape),
             "does not fit " + weight.name + " of shape " + shape_text(weight.shape));
    }
    check_type(i);
    owner->bias = i;
  }

  LayerOrder sort_parts() {
    std::vector<LayerShape> shapes;
    for (const LayerParts& parts : parts_) {
      const std::vector<std::uint64_t>& shape = tensors_[parts.weight].shape;
      shapes.push_back({parts.name, shape[1], shape[0]});
    }
    LayerOrder order = decide_layer_order(shapes, listing_, choice_, path_);
    std::vector<LayerParts> sorted;
    for (const std::size_t k : order.indices) sorted.push_back(parts_[k]);
    parts_ = std::move(sorted);
    return order;
  }

  Layer layer(const LayerParts& parts) const {
    const std::vector<std::uint64_t>& shape = tensors_[parts.weight].shape;
    Layer layer;
    layer.name = parts.name;
    layer.tensor = tensors_[parts.weight].name;
    layer.outputs = static_cast<int>(shape[0]);
    layer.inputs = static_cast<int>(shape[1]);
    layer.weights = finite_numbers(parts.weight);
    layer.biases = parts.bias == kNone ? std::vector<double>(shape[0], 0.0) : finite_numbers(parts.bias);
    return layer;
  }

  std::vector<double> finite_numbers(std::size_t i) const {
    std::vector<double> numbers = read_(i);
    for (std::size_t k = 0; k < numbers.size(); ++k) {
      if (!std::isfinite(numbers[k])) refuse_number(i, k, numbers[k]);
    }
    return numbers;
  }

  [[noreturn]] void refuse_number(std::size_t i, std::size_t k, double number) const {
    const DeclaredTensor& tensor = tensors_[i];
    std::string entry = std::to_string(k);
    if (tensor.shape.size() == 2) {
      const std::size_t columns = tensor.shape[1];
      entry = std::to_string(k / columns) + "," + std::to_string(k % columns);
    }
    throw InputError({path_, "", tensor.name + "[" + entry + "]",
                      std::isnan(number) ? "nan"
                      : number > 0       ? "inf"
                                         : "-inf",
                      "not finite",
                      "the training has diverged, or the file is damaged: take an earlier checkpoint"});
  }

  const std::vector<DeclaredTensor>& tensors_;
  const TensorReader& read_;
  const std::string& path_;
  const Listing listing_;
  const LayerChoice& choice_;
  std::vector<LayerParts> parts_;
  std::set<std::string> names_;
};

/// Returns whether a tensor's name says that it is a policy's standard deviation, or its logarithm: one word of the
/// last component does, as in log_std_parameter or sigma. Where a tensor of the same name is a mean, it normalizes.
bool is_deviation(const DeclaredTensor& tensor, const std::vector<DeclaredTensor>& all) {
  const std::size_t first = tensor.name.rfind('.') + 1;  // npos + 1 is 0
  for (std::size_t at = first; at < tensor.name.size();) {
    const std::size_t end = std::min(tensor.name.find('_', at), tensor.name.size());
    const std::string word = tensor.name.substr(at, end - at);
    if (word == "std" || word == "stds" || word == "logstd" || word == "sigma") {
      const std::string mean = tensor.name.substr(0, at) + "mean" + tensor.name.substr(end);
      return std::none_of(all.begin(), all.end(),
                          [&mean](const DeclaredTensor& other) { return other.name == mean; });
    }
    at = end + 1;
  }
  return false;
}

/// Returns whether tensor `name` belongs to `layer`.
bool is_of_layer(const std::string& name, const std::string& layer) {
  if (layer.empty()) return name.find('.') == std::string::npos;
  return name.size() > layer.size() && name[layer.size()] == '.' && name.compare(0, layer.size(), layer) == 0;
}

/// An order may leave out the layers of other modules, but not some layers of a module that it names.
void refuse_left_out(const std::vector<std::string>& order, const std::vector<std::string>& layers,
                     const std::string& path) {
  const std::vector<std::string> modules = modules_of(layers);
  const auto module_of = [&modules](const std::string& layer) -> std::string {
    for (const std::string& module : modules)
      if (modules.size() == 1 || has_prefix(layer, module)) return module;
    return layer;
  };
  std::set<std::string> named;
  for (const std::string& layer : order) named.insert(module_of(layer));
  for (const std::string& layer : layers)
    if (std::find(order.begin(), order.end(), layer) == order.end() && named.count(module_of(layer)) == 1)
      throw InputError(
          {path, "", "order", in_quotes(layer), "is left out", "name every layer of the network once"});
}

/// Returns which tensors belong to the chosen network.
/// @throws InputError if no name begins with a prefix that is to be selected.
std::function<bool(const std::string&)> chosen_by(const LayerChoice& choice,
                                                  const std::vector<DeclaredTensor>& tensors,
                                                  const std::string& path) {
  const auto any = [&tensors](const auto& is_chosen) {
    return std::any_of(tensors.begin(), tensors.end(),
                       [&](const DeclaredTensor& tensor) { return is_chosen(tensor.name); });
  };
  for (const std::string& prefix : choice.select) {
    if (any([&prefix](const std::string& name) { return has_prefix(name, prefix); })) continue;
    std::string list;
    for (const std::string& module : modules_of(layers_in(tensors)))
      list += (list.empty() ? "" : ", ") + module;
    throw InputError({path, "", "--select", in_quotes(prefix), "no layer's name begins like this",
                      list.empty() ? "leave --select out" : "its modules are " + list});
  }
  if (!choice.select.empty())
    return [&choice](const std::string& name) {
      return std::any_of(choice.select.begin(), choice.select.end(),
                         [&name](const std::string& prefix) { return has_prefix(name, prefix); });
    };
  const bool are_known = std::all_of(choice.order.begin(), choice.order.end(), [&](const std::string& layer) {
    return any([&layer](const std::string& name) { return is_of_layer(name, layer); });
  });
  if (choice.order.empty() || !are_known) return [](const std::string&) { return true; };
  refuse_left_out(choice.order, layers_in(tensors), path);
  return [&choice](const std::string& name) {
    return std::any_of(choice.order.begin(), choice.order.end(),
                       [&name](const std::string& layer) { return is_of_layer(name, layer); });
  };
}

template <typename Stored>
void append_as(const char* bytes, std::uint64_t count, std::uint64_t stride, std::vector<double>& numbers) {
  for (std::uint64_t i = 0; i < count; ++i) {
    Stored number;
    std::memcpy(&number, bytes + i * stride * sizeof number, sizeof number);
    numbers.push_back(static_cast<double>(number));
  }
}

void append_halves(const char* bytes, std::uint64_t count, std::uint64_t stride,
                   double (*number_of)(std::uint16_t), std::vector<double>& numbers) {
  for (std::uint64_t i = 0; i < count; ++i) {
    std::uint16_t bits;
    std::memcpy(&bits, bytes + i * stride * sizeof bits, sizeof bits);
    numbers.push_back(number_of(bits));
  }
}

}  // namespace

Weights assemble(const std::vector<DeclaredTensor>& declared, const TensorReader& read_declared,
                 const std::string& path, Listing listing, const LayerChoice& choice) {
  if (declared.size() > kMostTensors)
    throw InputError({path, "", "", "", "holds more than " + std::to_string(kMostTensors) + " tensors", ""});
  std::vector<std::size_t> kept;
  std::vector<std::string> unused;
  const std::function<bool(const std::string&)> is_chosen = chosen_by(choice, declared, path);
  for (std::size_t i = 0; i < declared.size(); ++i) {
    if (!is_chosen(declared[i].name)) {
      unused.push_back(declared[i].name + ": of another network, which was not selected");
    } else if (is_deviation(declared[i], declared)) {
      unused.push_back(declared[i].name + ": the deviation of a random policy, not part of its mean");
    } else {
      kept.push_back(i);
    }
  }
  std::vector<DeclaredTensor> tensors;
  for (const std::size_t i : kept) tensors.push_back(declared[i]);
  const TensorReader read = [&](std::size_t i) { return read_declared(kept[i]); };
  const EffectiveTensors effective = effective_tensors(tensors, read, path);
  const TensorReader read_effective = [&](std::size_t i) {
    const auto computed = effective.computed.find(i);
    return computed == effective.computed.end() ? read(effective.sources[i]) : computed->second.numbers;
  };
  Weights weights = Assembler(effective.tensors, read_effective, path, listing, choice).run();
  for (const auto& [i, computed] : effective.computed)
    for (Layer& layer : weights.layers)
      if (tensor_name(layer, "weight") == effective.tensors[i].name)
        layer.weight_rounding = computed.rounding;
  if (!effective.computed.empty() && weights.precision == Precision::kFloat32)
    weights.precision = least_precision(weights.layers);
  weights.notes.insert(weights.notes.end(), effective.notes.begin(), effective.notes.end());
  weights.unused = std::move(unused);
  weights.unused.insert(weights.unused.end(), effective.unused.begin(), effective.unused.end());
  return weights;
}

std::string tensor_name(const Layer& layer, const char* part) {
  return layer.name.empty() ? part : layer.name + "." + part;
}

void append_numbers(const char* bytes, std::uint64_t count, std::uint64_t stride, Precision precision,
                    std::vector<double>& numbers) {
  switch (precision) {
    case Precision::kFloat32:
      return append_as<float>(bytes, count, stride, numbers);
    case Precision::kFloat64:
      return append_as<double>(bytes, count, stride, numbers);
    case Precision::kFloat16:
      return append_halves(bytes, count, stride, from_float16, numbers);
    case Precision::kBfloat16:
      return append_halves(bytes, count, stride, from_bfloat16, numbers);
  }
}

double from_float16(std::uint16_t bits) {
  const double sign = (bits & 0x8000) != 0 ? -1.0 : 1.0;
  const int exponent = bits >> 10 & 0x1f;
  const int fraction = bits & 0x3ff;
  if (exponent == 0x1f)
    return fraction != 0 ? std::numeric_limits<double>::quiet_NaN()
                         : sign * std::numeric_limits<double>::infinity();
  if (exponent == 0) return sign * std::ldexp(fraction, -24);
  return sign * std::ldexp(1024 + fraction, exponent - 25);
}

double from_bfloat16(std::uint16_t bits) {
  const std::uint32_t wide = static_cast<std::uint32_t>(bits) << 16;
  float number;
  std::memcpy(&number, &wide, sizeof number);
  return static_cast<double>(number);
}

std::size_t width(Precision precision) {
  switch (precision) {
    case Precision::kFloat32:
      return 4;
    case Precision::kFloat16:
    case Precision::kBfloat16:
      return 2;
    case Precision::kFloat64:
      break;
  }
  return 8;
}

std::string shape_text(const std::vector<std::uint64_t>& shape) {
  std::string text = "[";
  for (std::size_t i = 0; i < shape.size(); ++i) text += (i == 0 ? "" : ", ") + std::to_string(shape[i]);
  return text + "]";
}

std::optional<std::uint64_t> element_count(const std::vector<std::uint64_t>& factors) {
  std::uint64_t product = 1;
  for (const std::uint64_t factor : factors) {
    if (factor == 0) return 0;
  }
  for (const std::uint64_t factor : factors) {
    if (factor > kMostElements / product) return std::nullopt;
    product *= factor;
  }
  return product;
}

}  // namespace swarmcert::files
