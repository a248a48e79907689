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

  /// A model in one HDF5 file: groups of layers by their names, and the configuration as an attribute.
  Weights run() {
    const Hdf5Object group = root_.has("model_weights") ? root_.open("model_weights") : root_;
    const auto layers = group.texts("layer_names");
    if (!layers)
      refuse("", "", "is an HDF5 file (.h5, .hdf5) without the layers of a Keras model",
             "write W1, b1, W2, b2, ... [outputs x inputs] with numpy.savez");
    const auto config = root_.texts("model_config");
    if (config && !config->empty()) read_config(config->front());
    for (const std::string& layer : *layers) {
      const Hdf5Object own = group.open(layer);
      for (const std::string& weight : own.texts("weight_names").value_or(std::vector<std::string>())) {
        const std::string part = weight.substr(weight.rfind('/') + 1);  // npos + 1 is 0
        read_tensor(own.open(weight), layer, part.substr(0, part.find(':')));
      }
    }
    return assembled();
  }

  /// A model of a .keras archive, whose HDF5 file numbers the layers of each class in the order of the configuration:
  /// layers/dense, layers/dense_1, ..., each with vars/0, the kernel, and vars/1, the bias.
  Weights run(const std::string& config) {
    read_config(config);
    const Hdf5Object group = root_.open(root_.has("layers") ? "layers" : "_layer_checkpoint_dependencies");
    for (std::size_t k = 0; k < stages_.size(); ++k) {
      const Hdf5Object vars = group.open("dense" + (k == 0 ? "" : "_" + std::to_string(k)) + "/vars");
      for (const std::string& name : vars.links()) {
        if (name != "0" && name != "1")
          refuse(in_quotes(stages_[k].layer), name, "has more than a kernel and a bias");
        read_tensor(vars.open(name), stages_[k].layer, name == "0" ? "kernel" : "bias");
        if (name == "0" && declared_.back().shape[0] != stages_[k].units)
          refuse(in_quotes(stages_[k].layer), shape_text(declared_.back().shape),
                 "does not have the " + std::to_string(stages_[k].units) + " outputs of the configuration",
                 kCopyAgain);
      }
    }
    return assembled();
  }

 private:
  Weights assembled() {
    const TensorReader read = [this](std::size_t i) { return numbers_[i]; };
    Weights weights =
        assemble(declared_, read, path_, is_stated_ ? Listing::kEvaluation : Listing::kRegistration, choice_);
    weights.notes.insert(weights.notes.end(), notes_.begin(), notes_.end());
    if (!is_stated_) return weights;
    std::vector<std::string> activations;
    for (const Layer& layer : weights.layers) activations.push_back(activation_after(layer.name));
    return with_activation_of_file(std::move(weights), activations, "model_config");
  }

  [[noreturn]] void refuse(const std::string& field, const std::string& value, const std::string& what,
                           const std::string& hint = kExportOnnx) const {
    throw InputError({path_, "", field, value, what, hint});
  }

  struct Stage {
    std::string layer, activation;
    std::uint64_t units = 0;
  };

  static std::string text(const Json& json, const char* key) {
    return json.is_object() && json.contains(key) && json[key].is_string() ? json[key].get<std::string>()
                                                                           : "";
  }
  double number(const Json& json, const char* key, double otherwise) const {
    if (!json.contains(key) || json[key].is_null()) return otherwise;
    if (!json[key].is_number())
      refuse("model_config", in_quotes(text(json, "name")), "has no number as its " + std::string(key));
    return json[key].get<double>();
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
    if (kind != "Sequential") require_output(config.value("output_layers", Json()), before);
    is_stated_ = true;
  }

  /// Outputs are [["name", 0, 0]], or ["name", 0, 0] of a single one.
  void require_output(const Json& outputs, const std::string& last) const {
    const bool is_list = outputs.is_array() && !outputs.empty();
    const Json one = is_list && outputs.size() == 1 ? outputs[0] : outputs;
    if (!is_list || !one.is_array() || one.empty() || one[0] != last)
      refuse("model_config", in_quotes(last), "is the last layer, but not the only output");
  }

  /// Inbound nodes are [[["name", 0, 0, {}]]], and since version 3
  /// [{"args": [{"class_name": "__keras_tensor__", "config": {"keras_history": ["name", 0, 0]}}]}].
  void require_after(const Json& layer, const std::string& name, const std::string& before) const {
    const auto only = [](const Json& list) { return list.is_array() && list.size() == 1 ? list[0] : Json(); };
    const Json node = only(layer.value("inbound_nodes", Json::array()));
    Json history = only(node);
    if (node.is_object()) {
      const Json tensor = only(node.value("args", Json()));
      if (tensor.is_object()) history = tensor.value("config", Json::object()).value("keras_history", Json());
    }
    const bool is_after = history.is_array() && !history.empty() && history[0] == before;
    if (!is_after) refuse("model_config", in_quotes(name), "does not take the layer before it alone");
  }

  void read_stage(const std::string& kind, const std::string& name, const Json& config) {
    static const std::set<std::string> kIdentities = {
        "InputLayer",  "Dropout", "GaussianNoise", "GaussianDropout", "ActivityRegularization",
        "AlphaDropout"};
    if (kIdentities.count(kind) == 1) return;
    if (kind == "Dense") {
      stages_.push_back({name, activation_of(config, name), config.value("units", std::uint64_t{0})});
    } else if (kind == "Activation") {
      activate(name, activation_of(config, name));
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

  std::string activation_of(const Json& config, const std::string& layer) {
    const Json stated = config.value("activation", Json());
    if (!stated.is_null() && !stated.is_string())
      refuse("model_config", in_quotes(layer), "has an activation of its own, which is not read");
    const std::string word = text(config, "activation");
    if (word == "leaky_relu") return "leaky_relu:0.2";  // that of Keras; PyTorch's slope is 0.01
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

  void read_tensor(const Hdf5Object& tensor, const std::string& layer, const std::string& part) {
    hdf5::Numbers stored = tensor.numbers();
    const bool is_kernel = part == "kernel" && stored.shape.size() == 2;
    if (!is_kernel && part != "bias")
      refuse(in_quotes(layer + "/" + part), shape_text(stored.shape), "is not part of a Dense layer");
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

constexpr std::uint64_t kLargestModel_bytes = std::uint64_t{1} << 29;

}  // namespace

bool is_keras_archive(const ZipArchive& archive) {
  return archive.has("config.json") && archive.has("model.weights.h5");
}

Weights parse_keras_archive(const ZipArchive& archive, const std::string& path, const LayerChoice& choice) {
  const std::string config = archive.read("config.json", kLargestModel_bytes);
  return KerasReader(archive.read("model.weights.h5", kLargestModel_bytes), path, choice).run(config);
}

Weights parse_keras(const std::string& bytes, const std::string& path, const LayerChoice& choice) {
  return KerasReader(bytes, path, choice).run();
}

}  // namespace swarmcert::files
