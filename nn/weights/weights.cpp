#include "nn/weights/weights.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <stdexcept>

#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/weights/c_source.h"
#include "nn/weights/enclosed.h"
#include "nn/weights/hdf5.h"
#include "nn/weights/keras.h"
#include "nn/weights/matlab/mat_file.h"
#include "nn/weights/matlab/mat_network.h"
#include "nn/weights/named_arrays.h"
#include "nn/weights/nnet.h"
#include "nn/weights/onnx/onnx.h"
#include "nn/weights/pth.h"
#include "nn/weights/safetensors.h"

namespace swarmcert::files {
namespace {

[[noreturn]] void refuse_format(const std::string& bytes, const std::string& path) {
  std::string what =
      "is neither a PyTorch state dict (.pth), safetensors, ONNX, Keras (.h5, .keras), .npz, .mat, "
      ".nnet nor generated C weights";
  std::string hint = "save one with torch.save(model.state_dict(), ...)";
  if (bytes.empty()) {
    what = "is empty";
    hint = "copy it again";
  } else if (bytes[0] == '\x80') {
    what = "is a bare pickle, which torch.save does not write";
  } else if (bytes.compare(0, 24, "version https://git-lfs.") == 0) {
    what = "is a Git LFS pointer, not the file itself";
    hint = "fetch it: git lfs pull";
  } else if (bytes.compare(std::min<std::size_t>(4, bytes.size()), 4, "TFL3") == 0) {
    what = "is a TensorFlow Lite model (.tflite), which is not supported";
    hint = "convert it to ONNX: python -m tf2onnx.convert --tflite net.tflite --output net.onnx";
  }
  throw InputError({path, "offset 0", "", "", what, hint});
}

void refuse_key(const std::string& key, const std::string& path, const std::string& format) {
  if (key.empty()) return;
  throw InputError({path, "", "--key", in_quotes(key), format + " files are not nested", "leave --key out"});
}

}  // namespace

const char* name(Precision precision) {
  switch (precision) {
    case Precision::kFloat32:
      return "float32";
    case Precision::kFloat16:
      return "float16";
    case Precision::kBfloat16:
      return "bfloat16";
    case Precision::kFloat64:
      break;
  }
  return "float64";
}

std::vector<Activation> Weights::activations() const {
  std::vector<Activation> result;
  for (std::size_t k = 0; k + 1 < layers.size(); ++k) result.push_back(layers[k].activation);
  return result;
}

std::vector<double> Weights::steepest_slopes() const {
  std::vector<double> result;
  for (std::size_t k = 0; k + 1 < layers.size(); ++k) {
    const double own = function_of(layers[k].activation).steepest();
    result.push_back(layers[k].kept > 0 ? std::max(own, 1.0) : own);
  }
  return result;
}

std::string op_after(const Layer& layer) {
  const std::string op = function_of(layer.activation).op;
  return layer.kept > 0 ? op + ":" + std::to_string(layer.outputs - layer.kept) : op;
}

std::string words_after(const Layer& layer) {
  const std::string words = function_of(layer.activation).words;
  return layer.kept > 0 ? words + " of the first " + std::to_string(layer.outputs - layer.kept) : words;
}

std::string Weights::activation_names() const {
  std::vector<std::string> all;
  for (std::size_t k = 0; k + 1 < layers.size(); ++k) all.push_back(op_after(layers[k]));
  const bool are_alike = std::adjacent_find(all.begin(), all.end(), std::not_equal_to<>()) == all.end();
  std::string names;
  for (const std::string& op : all) {
    names += (names.empty() ? "" : ", ") + op;
    if (are_alike) break;
  }
  return names;
}

bool Weights::is_relu() const {
  const std::vector<Activation> all = activations();
  return std::all_of(all.begin(), all.end(), [](Activation one) { return one == Activation::kRelu; });
}

void Weights::set_activations(const std::vector<Activation>& between) {
  if (between.size() + 1 != layers.size())
    throw std::invalid_argument("Weights: needs one activation for each layer but the last");
  for (std::size_t k = 0; k < between.size(); ++k) layers[k].activation = between[k];
}

void Weights::end_in(Activation activation) {
  Layer identity;
  const auto has = [this](const std::string& taken) {
    return std::any_of(layers.begin(), layers.end(), [&](const Layer& layer) { return layer.name == taken; });
  };
  const std::string number = "layer" + std::to_string(layers.size() + 1);
  identity.name = number;
  identity.is_added = true;
  while (has(identity.name)) identity.name = number + "_" + identity.name;
  const int size = outputs();
  identity.outputs = identity.inputs = size;
  identity.weights.assign(static_cast<std::size_t>(size) * static_cast<std::size_t>(size), 0.0);
  for (std::size_t i = 0; i < identity.weights.size(); i += static_cast<std::size_t>(size) + 1)
    identity.weights[i] = 1;
  identity.biases.assign(static_cast<std::size_t>(size), 0.0);
  layers.back().activation = activation;
  layers.push_back(std::move(identity));
}

double rounding_of_slope(const Weights& weights) {
  constexpr double kUp = 1 + 0x1p-26;  // covers the round-off for as many layers as a file can hold
  double product = 1, share = 0;       // of |W|_F; sum of weight_rounding / |W|_F
  for (const Layer& layer : weights.layers) {
    const double norm = norm_up(layer.weights);
    product *= norm * kUp;
    if (layer.weight_rounding > 0) share += layer.weight_rounding / norm * kUp;
  }
  for (const double steepest : weights.steepest_slopes()) product *= steepest * kUp;
  if (!(share > 0)) return 0;
  return product * std::expm1(share * kUp) * kUp * kUp;  // 1 + s <= exp(s)
}

const char* name(OrderSource source) {
  switch (source) {
    case OrderSource::kFile:
      return "file";
    case OrderSource::kNames:
      return "names";
    case OrderSource::kShapes:
      return "shapes";
    case OrderSource::kUser:
      break;
  }
  return "user";
}

Weights parse_weights(const std::string& bytes, const std::string& path, const std::string& key,
                      const LayerChoice& choice) {
  Weights weights;
  if (looks_like_npz(bytes)) {
    refuse_key(key, path, ".npz");
    weights = parse_npz(bytes, path, choice);
  } else if (looks_like_pth_zip(bytes)) {
    weights = parse_pth_zip(bytes, path, key, choice);
  } else if (looks_like_pth_legacy(bytes)) {
    weights = parse_pth_legacy(bytes, path, key, choice);
  } else if (looks_like_safetensors(bytes)) {
    refuse_key(key, path, "safetensors");
    weights = parse_safetensors(bytes, path, choice);
  } else if (looks_like_onnx(bytes)) {
    refuse_key(key, path, "ONNX");
    weights = parse_onnx(bytes, path, choice);
  } else if (looks_like_mat(bytes)) {
    refuse_key(key, path, ".mat");
    weights = parse_mat(bytes, path, choice);
  } else if (looks_like_hdf5(bytes)) {
    refuse_key(key, path, "HDF5");
    weights = parse_keras(bytes, path, choice);
  } else if (looks_like_nnet(bytes)) {
    refuse_key(key, path, ".nnet");
    weights = parse_nnet(bytes, path, choice);
  } else if (looks_like_c_source(bytes)) {
    weights = parse_c_source(bytes, path, key, choice);
  } else {
    refuse_format(bytes, path);
  }
  weights.sha256 = sha256(bytes);
  return weights;
}

Weights load_weights(const std::string& path, const std::string& key, const LayerChoice& choice) {
  const std::size_t mark = path.rfind('#');
  if (mark == std::string::npos || mark + 1 == path.size() || std::filesystem::exists(path))
    return parse_weights(read_file(path), path, key, choice);
  const std::string file = path.substr(0, mark);
  if (!key.empty())
    throw InputError(
        {file, "", "--key", in_quotes(key), "the name of the file already names a key", "name one key"});
  return parse_weights(read_file(file), file, path.substr(mark + 1), choice);
}

}  // namespace swarmcert::files
