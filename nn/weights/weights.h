/// @file A network as its weight file holds it: every weight exactly, in double.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "nn/mlp.h"
#include "nn/weights/activation_function.h"

namespace swarmcert::files {

/// A format of numbers. All convert to double without rounding. A network is float32 or float64: one that a file stores
/// in half precision, float16 or bfloat16, is a float32 network.
enum class Precision { kFloat32, kFloat64, kFloat16, kBfloat16 };

/// "float32", "float64", "float16", "bfloat16".
const char* name(Precision precision);

/// What the order of the layers rests on. A file that states it states the activation between the layers as well; in
/// every other case the activation is given (`activation_is_given`) or assumed to be ReLU.
enum class OrderSource {
  kFile,    ///< the file states it: ONNX, our safetensors
  kNames,   ///< numbers in the names, which agree with the order of registration where there is one
  kShapes,  ///< no other order fits the shapes
  kUser,    ///< --order, or `order` in network.toml
};

/// "file", "names", "shapes", "user".
const char* name(OrderSource source);

/// One affine layer y = W x + b.
struct Layer {
  std::string name;  ///< as in the file, without ".weight": "fc1"
  int outputs = 0;
  int inputs = 0;
  std::vector<double> weights;  ///< W, [outputs x inputs], row-major
  std::vector<double> biases;   ///< b, [outputs]; zeros where the file has none
  /// Where the file's own W or b, folded out of several layers, is no double: it is within this Frobenius norm of
  /// `weights`, and within this Euclidean norm of `biases`. 0: they are the file's own.
  double weight_rounding = 0;
  double bias_rounding = 0;
  Activation activation =
      Activation::kRelu;  ///< between this layer and the next; of the last one without meaning
  /// How many of the outputs, the last ones, the activation leaves as they are: what a skip connection takes past it. 0
  /// where the activation is ReLU or sorts.
  int kept = 0;
  bool is_added = false;  ///< no layer of the file: the identity behind an activation that ends the network
};

/// What follows `layer`, as chains state it: "tanh", or "tanh:8" of the first 8 outputs only.
std::string op_after(const Layer& layer);
/// The same in texts: "tanh", "tanh of the first 8".
std::string words_after(const Layer& layer);

/// A multilayer perceptron: after every layer but the last an activation, ReLU unless stated otherwise. One that ends
/// in an activation has an identity layer behind it.
/// Class invariant after load_weights(): at least one layer, every size positive, layers[k].inputs ==
/// layers[k - 1].outputs, all entries finite.
struct Weights {
  std::string path;    ///< as the user gave it
  std::string sha256;  ///< of the file's bytes, lower-case hex
  Precision precision = Precision::kFloat32;
  std::vector<Layer> layers;
  OrderSource order_source = OrderSource::kFile;
  bool activation_is_given = false;  ///< by `activation` in network.toml, or by --activation
  std::vector<std::string> notes;    ///< what was folded, rewritten, left out or assumed; one clause each

  int inputs() const { return layers.front().inputs; }
  int outputs() const { return layers.back().outputs; }
  /// What follows each layer but the last, first layer first.
  std::vector<Activation> activations() const;
  /// The steepest slope of each.
  std::vector<double> steepest_slopes() const;
  /// Their names as chains state them, each once where all are alike: "tanh", "relu, relu, tanh".
  std::string activation_names() const;
  bool is_relu() const;  ///< whether all of them are ReLU
  /// Sets what lies between all layers. @throws std::invalid_argument unless there is one for each layer but the last.
  void set_activations(const std::vector<Activation>& between);
  /// Puts a layer of weights 1 and biases 0 behind the last one, which `activation` then follows.
  void end_in(Activation activation);
  /// Whether the file itself, network.toml or the user states the activation.
  bool states_activation() const { return order_source == OrderSource::kFile || activation_is_given; }
};

/// Reads a weight file. The format is found from the content, not from the name: PyTorch state dicts (`.pth`, zip
/// and legacy pickle, strided views, weights under spectral_norm and weight_norm), safetensors, ONNX models of affine
/// and piecewise linear operations and smooth activations, NumPy's .npz, MATLAB's .mat (version 5), .nnet, and
/// the C source that the networks' authors generate.
/// A layer is a 2-D tensor `<name>.weight` with an optional 1-D `<name>.bias`. Which layer follows which, ONNX models,
/// .nnet and our safetensors state; for other files see decide_layer_order().
/// @param path where no such file exists, "FILE#KEY" is FILE with the key KEY.
/// @param key for nested checkpoints: the dotted path of the state dict inside it, e.g. "model"; empty: the top. For C
///   source: the name of one of its networks.
/// @param order every layer of the file once, first evaluated first; empty: not stated.
/// @throws InputError for anything that is not such a network: it names offset, field, value and hint.
Weights load_weights(const std::string& path, const std::string& key = "",
                     const std::vector<std::string>& order = {});

/// As load_weights(), from memory. `path` is used in messages only.
Weights parse_weights(const std::string& bytes, const std::string& path, const std::string& key = "",
                      const std::vector<std::string>& order = {});

/// Writes safetensors with tensors `<name>.weight` and `<name>.bias` in the network's precision.
/// @throws InputError if the file exists and `overwrite` is false, if the name of a layer is not UTF-8, or if an
///   activation is not ReLU, which this format states.
void save_safetensors(const Weights& weights, const std::string& path, bool overwrite);

/// How much larger than the Lipschitz constant of the network as it was read that of the file's own function can be,
/// where its folded weights are no doubles: the product of |W|_F + weight_rounding less the product of |W|_F, times the
/// activations' steepest slopes. It may be
/// added to every bound that holds for all slopes that the activations can have. 0 where nothing was rounded.
double rounding_of_slope(const Weights& weights);

/// Every number rounded to the nearest float32, ties to even: what a C compiler makes of a float64 file's numbers.
/// A float32 network stays as it is.
/// @throws InputError if a number is beyond the range of float32.
Weights as_float32(Weights weights);

/// The evaluator's view of a network, with the arrays it points to.
/// In float each weight is rounded to nearest: for a float32 file that is exact. Float evaluates ReLU networks only, as
/// firmware does.
template <typename Scalar>
class Evaluator {
 public:
  /// @throws InputError if a weight is beyond the range of Scalar, or Scalar is float and an activation not ReLU.
  explicit Evaluator(const Weights& weights);
  Evaluator(const Evaluator&) = delete;
  Evaluator& operator=(const Evaluator&) = delete;
  Evaluator(Evaluator&&) = default;

  /// The ReLU network. @throws std::logic_error if an activation is another one.
  nn::Mlp<Scalar> mlp() const;

  /// f(x); `input` has as many entries as the network has inputs, the result as many as it has outputs.
  /// @throws std::invalid_argument if `input` has another length.
  std::vector<Scalar> operator()(const std::vector<Scalar>& input) const;

 private:
  std::vector<Scalar> smooth_value(const std::vector<Scalar>& input) const;

  bool is_relu_;
  std::vector<Activation> activations_;  ///< after each layer but the last
  std::vector<int> kept_;                ///< of each layer
  std::vector<std::vector<Scalar>> arrays_;
  std::vector<nn::DenseLayer<Scalar>> layers_;
};

extern template class Evaluator<float>;
extern template class Evaluator<double>;

}  // namespace swarmcert::files
