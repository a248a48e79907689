#include "nn/weights/keras.h"

#include <algorithm>
#include <set>
#include <utility>

#include "nn/base/input_error.h"
#include "nn/base/json.h"
#include "nn/weights/activation.h"
#include "nn/weights/hdf5.h"
#include "nn/weights/tensors.h"

namespace swarmcert::files {
namespace {

constexpr char kExportOnnx[] =
    "export it to ONNX: python -m tf2onnx.convert --keras net.h5 --output net.onnx";

class KerasReader {
 public:
  KerasReader(const std::string& bytes, const std::string& path, const LayerChoice& choice)
      : root_(hdf5_root(bytes, path)), path_(path), choice_(choice) {}

  Weights run() {
    const Hdf5Object group = root_.has("model_weights") ? root_.open("model_weights") : root_;
    const auto layers = group.texts("layer_names");
    if (!layers)
      refuse("", "", "is an HDF5 file (.h5, .hdf5) without the layers of a Keras model",
             "write W1, b1, W2, b2, ... [outputs x inputs] with numpy.savez");
    const auto config = root_.texts("model_config");
    if (config && !config->empty()) read_config(config->front());
    for (const std::string& layer : *layers) read_layer(group, layer);
    const TensorReader read = [this](std::size_t i) { return numbers_[i]; };
    Weights weights =
        assemble(declared_, read, path_, is_stated_ ? Listing::kEvaluation : Listing::kRegistration, choice_);
    weights.notes.insert(weights.notes.end(), notes_.begin(), notes_.end());
    if (!is_stated_) return weights;
    std::vector<std::string> activations;
    for (const Layer& layer : weights.layers) activations.push_back(activation_after(layer.name));
    return with_activation_of_file(std::move(weights), activations, "model_config");
  }

 private:
  [[noreturn]] void refuse(const std::string& field, const std::string& value, const std::string& what,
                           const std::string& hint = kExportOnnx) const {
    throw InputError({path_, "", field, value, what, hint});
  }

  struct Stage {
    std::string layer, activation;
  };

  static std::string text(const Json& json, const char* key) {
    return json.is_object() && json.contains(key) && json[key].is_string() ? json[key].get<std::string>()
                                                                           : "";
  }
  static double number(const Json& json, const char* key, double otherwise) {
    return json.contains(key) && json[key].is_number() ? json[key].get<double>() : otherwise;
  }

  /// Reads the layers of a Sequential model, or of another one in which each layer takes the layer before it.
  void read_config(const std::string& stated) {
    const Json model = parse_json(stated, path_ + ": model_config");
    const std::string kind = text(model, "class_name");
    if (!model.is_object() || !model.contains("config")) refuse("model_config", "", "has no config");
    const Json& config = model["config"];
    const Json* const layers = config.is_array()                                 ? &config
                               : config.is_object() && config.contains("layers") ? &config["layers"]
                                                                                 : nullptr;
    if (layers == nullptr || !layers->is_array()) refuse("model_config", in_quotes(kind), "lists no layers");
    std::string before;
    for (const Json& layer : *layers) {
      const std::string name = text(layer.value("config", Json::object()), "name");
      if (kind != "Sequential" && text(layer, "class_name") != "InputLayer")
        require_after(layer, name, before);
      read_stage(text(layer, "class_name"), name, layer.value("config", Json::object()));
      before = name;
    }
    is_stated_ = true;
  }

  /// Inbound nodes are [[["name", 0, 0, {}]]].
  void require_after(const Json& layer, const std::string& name, const std::string& before) const {
    const Json nodes = layer.value("inbound_nodes", Json::array());
    const bool is_after = nodes.is_array() && nodes.size() == 1 && nodes[0].is_array() &&
                          nodes[0].size() == 1 && nodes[0][0].is_array() && !nodes[0][0].empty() &&
                          nodes[0][0][0] == before;
    if (!is_after) refuse("model_config", in_quotes(name), "does not take the layer before it alone");
  }

  void read_stage(const std::string& kind, const std::string& name, const Json& config) {
    static const std::set<std::string> kIdentities = {
        "InputLayer",  "Dropout", "GaussianNoise", "GaussianDropout", "ActivityRegularization",
        "AlphaDropout"};
    if (kIdentities.count(kind) == 1) return;
    if (kind == "Dense") {
      stages_.push_back({name, activation_called(text(config, "activation"), name)});
    } else if (kind == "Activation") {
      activate(name, activation_called(text(config, "activation"), name));
    } else if (kind == "ReLU") {
      const bool is_plain = number(config, "negative_slope", 0) == 0 && number(config, "threshold", 0) == 0;
      const double most = number(config, "max_value", 0);
      if (!is_plain || (most != 0 && most != 6))
        refuse("model_config", in_quotes(name), "is not relu or relu6");
      activate(name, most == 6 ? "relu6" : "relu");
    } else if (kind == "LeakyReLU") {
      const double slope = number(config, "alpha", number(config, "negative_slope", 0.3));
      activate(name, "leaky_relu:" + Json(slope).dump());
    } else if (kind == "ELU" && number(config, "alpha", 1) == 1) {
      activate(name, "elu");
    } else {
      refuse("model_config", in_quotes(name),
             "is a layer of the kind " + in_quotes(kind) + ", which is not read");
    }
  }

  std::string activation_called(const std::string& word, const std::string& layer) {
    if (word != "softmax") return word.empty() ? "linear" : word;
    notes_.push_back("the softmax of " + layer + " is omitted: all results are for the logits");
    softmax_ = layer;
    return "linear";
  }

  void activate(const std::string& name, const std::string& activation) {
    if (stages_.empty() || stages_.back().activation != "linear")
      refuse("model_config", in_quotes(name), "follows no Dense layer without activation");
    stages_.back().activation = activation;
  }

  std::string activation_after(const std::string& layer) const {
    const auto stage = std::find_if(stages_.begin(), stages_.end(),
                                    [&layer](const Stage& one) { return one.layer == layer; });
    if (stage == stages_.end()) refuse("model_config", in_quotes(layer), "is no Dense layer of the model");
    if (!softmax_.empty() && softmax_ == layer && stage != stages_.end() - 1)
      refuse("model_config", in_quotes(layer), "has a softmax, which is read as the last activation only");
    return stage->activation;
  }

  void read_layer(const Hdf5Object& group, const std::string& layer) {
    const Hdf5Object own = group.open(layer);
    for (const std::string& weight : own.texts("weight_names").value_or(std::vector<std::string>())) {
      hdf5::Numbers stored = own.open(weight).numbers();
      std::string part = weight.substr(weight.rfind('/') + 1);  // npos + 1 is 0
      part = part.substr(0, part.find(':'));
      const bool is_kernel = part == "kernel" && stored.shape.size() == 2;
      if (!is_kernel && part != "bias")
        refuse(in_quotes(weight), shape_text(stored.shape), "is not part of a Dense layer");
      if (is_kernel) {  // [inputs, outputs]
        std::vector<double> transposed;
        transposed.reserve(stored.numbers.size());
        for (std::uint64_t out = 0; out < stored.shape[1]; ++out)
          for (std::uint64_t in = 0; in < stored.shape[0]; ++in)
            transposed.push_back(stored.numbers[in * stored.shape[1] + out]);
        stored.numbers = std::move(transposed);
        std::swap(stored.shape[0], stored.shape[1]);
      }
      declared_.push_back({layer + (is_kernel ? ".weight" : ".bias"),
                           stored.is_float32 ? Precision::kFloat32 : Precision::kFloat64, "", stored.shape});
      numbers_.push_back(std::move(stored.numbers));
    }
  }

  Hdf5Object root_;
  const std::string& path_;
  const LayerChoice& choice_;
  bool is_stated_ = false;  ///< by model_config
  std::vector<Stage> stages_;
  std::string softmax_;  ///< the layer that it follows
  std::vector<DeclaredTensor> declared_;
  std::vector<std::vector<double>> numbers_;
  std::vector<std::string> notes_;
};

}  // namespace

Weights parse_keras(const std::string& bytes, const std::string& path, const LayerChoice& choice) {
  return KerasReader(bytes, path, choice).run();
}

}  // namespace swarmcert::files
