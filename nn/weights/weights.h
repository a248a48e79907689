/// @file A network as stored in its weight file: every weight exactly, in double.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "nn/mlp.h"
#include "nn/weights/activation_function.h"
#include "nn/weights/layer_choice.h"

namespace swarmcert::files {

/// A number format. All formats convert to double without rounding. A network is either float32 or float64; files in
/// half precision, float16 or bfloat16, are read as float32 networks.
enum class Precision { kFloat32, kFloat64, kFloat16, kBfloat16 };

/// Returns "float32", "float64", "float16" or "bfloat16".
const char* name(Precision precision);

/// What determines the order of the layers.
enum class OrderSource {
  kFile,    ///< the file states it: ONNX, our safetensors
  kNames,   ///< numbers in the names, consistent with the order of registration if there is one
  kShapes,  ///< no other order fits the shapes
  kUser,    ///< --order, or `order` in network.toml
};

/// Returns "file", "names", "shapes" or "user".
const char* name(OrderSource source);

/// What states the activations between the layers.
enum class ActivationSource {
  kDefault,  ///< nothing: ReLU
  kFile,     ///< the file: ONNX, our safetensors, act_fcns of .mat files, the policies of Stable-Baselines3
  kUser,     ///< --activation, or `activation` in network.toml
};

/// One affine layer y = W x + b.
struct Layer {
  std::string name;  ///< as in the file, without ".weight": "fc1"
  int outputs = 0;
  int inputs = 0;
  std::vector<double> weights;  ///< W, [outputs x inputs], row-major
  std::vector<double> biases;   ///< b, [outputs]; zeros if the file has none
  /// Bounds on the rounding error if the file's W or b, folded from several layers, is not representable in double: the
  /// Frobenius norm of the error of `weights` and the Euclidean norm of that of `biases`. 0: the values are exact.
  double weight_rounding = 0;
  double bias_rounding = 0;
  Activation activation =
      Activation::kRelu;  ///< between this layer and the next; meaningless for the last one
  /// Number of trailing outputs to which the activation is not applied, because a skip connection carries them past it.
  /// Is 0 if the activation is ReLU or sorts.
  int kept = 0;
  bool is_added = false;    ///< not in the file: an identity layer added after a final activation
  std::string tensor = {};  ///< that holds the weights: "fc1.weight"; empty: they were folded or rewritten
};

/// Returns the activation after `layer` as stated in chains: "tanh", or "tanh:8" for the first 8 outputs only.
std::string op_after(const Layer& layer);
/// Same, in prose: "tanh", "tanh of the first 8".
std::string words_after(const Layer& layer);

/// A multilayer perceptron with an activation after every layer but the last, ReLU unless stated otherwise. A network
/// that ends in an activation is stored with an identity layer after it.
/// Class invariant after load_weights(): at least one layer, every size positive, layers[k].inputs ==
/// layers[k - 1].outputs, all entries finite.
struct Weights {
  std::string path;    ///< as the user gave it
  std::string sha256;  ///< of the file's bytes, lower-case hex
  Precision precision = Precision::kFloat32;
  std::vector<Layer> layers;
  OrderSource order_source = OrderSource::kFile;
  ActivationSource activation_source = ActivationSource::kFile;
  std::vector<std::string> notes;  ///< what was folded, rewritten or omitted; one clause each
  /// What the reader guessed about the function, one clause each. A result about this network is a result about the
  /// trained one only if these hold; unless the user states them or recorded samples confirm them, nothing is proved.
  std::vector<std::string> assumed;
  /// Other files that hold numbers of this one, with their SHA-256: ONNX's external data.
  std::vector<std::pair<std::string, std::string>> data_files;
  std::vector<std::string>
      unused;  ///< tensors and entries of the file that are not part of the network, with the reason
  /// The matrices as stored, without biases, if `layers` are not these: activations or parts of layers were rewritten
  /// or folded. Norms and limits on them are stated for these. Empty: they are the layers.
  std::vector<Layer> stored;

  int inputs() const { return layers.front().inputs; }
  int outputs() const { return layers.back().outputs; }
  /// Returns the activation after each layer but the last, in order of evaluation.
  std::vector<Activation> activations() const;
  /// Returns the steepest slope of each activation.
  std::vector<double> steepest_slopes() const;
  /// Returns their names as in chains, once if all are the same: "tanh", "relu, relu, tanh".
  std::string activation_names() const;
  bool is_relu() const;  ///< whether all activations are ReLU
  /// Sets the activations between all layers.
  /// @throws std::invalid_argument unless there is one for each layer but the last.
  void set_activations(const std::vector<Activation>& between);
  /// Makes the network end in `activation`: appends an identity layer and puts `activation` in front of it.
  void end_in(Activation activation);
  /// Returns whether the file itself, network.toml or the user states the activation.
  bool states_activation() const { return activation_source != ActivationSource::kDefault; }
  /// Returns the matrices as stored.
  const std::vector<Layer>& stored_layers() const { return stored.empty() ? layers : stored; }
};

/// Reads a weight file. The format is detected from the content, not from the name: PyTorch state dicts (`.pth`, zip
/// and legacy pickle, strided views, weights under spectral_norm and weight_norm), safetensors, ONNX models of affine
/// and piecewise linear operations and smooth activations, NumPy's .npz, MATLAB's .mat (versions 5 and 7.3), .nnet, and
/// the C source that the networks' authors generate.
/// A layer is a 2-D tensor `<name>.weight` with an optional 1-D `<name>.bias`. ONNX models, .nnet and our safetensors
/// state the order of the layers; for other files see decide_layer_order().
/// @param path if no such file exists, "FILE#KEY" is FILE with the key KEY.
/// @param key for nested checkpoints: the dotted path of the state dict, e.g. "model"; empty: the top level. For C
///   source: the name of one of its networks.
/// @param choice the layers of the network, if the file does not state them or holds others.
/// @throws InputError with offset, field, value and hint for anything that is not such a network.
Weights load_weights(const std::string& path, const std::string& key = "", const LayerChoice& choice = {});

/// Same as load_weights(), but reads from memory; `path` is used in messages, and for its folder, in which ONNX's
/// external data lie.
Weights parse_weights(const std::string& bytes, const std::string& path, const std::string& key = "",
                      const LayerChoice& choice = {});

/// Writes safetensors with tensors `<name>.weight` and `<name>.bias` in the network's precision.
/// @throws InputError if the file exists and `overwrite` is false, if a layer's name is not UTF-8, or if an activation
///   is not ReLU, which our safetensors files imply.
void save_safetensors(const Weights& weights, const std::string& path, bool overwrite);

/// Returns a bound on how much larger the Lipschitz constant of the file's own function can be than that of the network
/// as read, because folded weights were rounded: the product of |W|_F + weight_rounding minus the product of |W|_F,
/// times the activations' steepest slopes. It may be added to any bound that holds for all slopes that the activations
/// can have. Is 0 if nothing was rounded.
double rounding_of_slope(const Weights& weights);

/// Returns the network with every number rounded to the nearest float32, ties to even, as a C compiler does with the
/// numbers of a float64 file. A float32 network is unchanged.
/// @throws InputError if a number exceeds the range of float32.
Weights as_float32(Weights weights);

/// The evaluator's view of a network, together with the arrays that it points to. In float, each weight is rounded to
/// nearest, which is exact for a float32 file. Like the firmware, the float instance evaluates ReLU networks only.
template <typename Scalar>
class Evaluator {
 public:
  /// @throws InputError if a weight exceeds the range of Scalar, or if Scalar is float and an activation is not ReLU.
  explicit Evaluator(const Weights& weights);
  Evaluator(const Evaluator&) = delete;
  Evaluator& operator=(const Evaluator&) = delete;
  Evaluator(Evaluator&&) = default;

  /// Returns the ReLU network. @throws std::logic_error if an activation is not ReLU.
  nn::Mlp<Scalar> mlp() const;

  /// Returns f(x). `input` has one entry per input of the network, the result one per output.
  /// @throws std::invalid_argument if `input` has another length.
  std::vector<Scalar> operator()(const std::vector<Scalar>& input) const;

 private:
  std::vector<Scalar> smooth_value(const std::vector<Scalar>& input) const;

  bool is_relu_;
  std::vector<Activation> activations_;  ///< after each layer but the last
  std::vector<int> kept_;                ///< of each layer: see Layer::kept
  std::vector<std::vector<Scalar>> arrays_;
  std::vector<nn::DenseLayer<Scalar>> layers_;
};

extern template class Evaluator<float>;
extern template class Evaluator<double>;

}  // namespace swarmcert::files
