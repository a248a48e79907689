#include "nn/weights/matlab/mat_network.h"

#include <algorithm>
#include <set>
#include <utility>

#include "nn/base/input_error.h"
#include "nn/weights/activation.h"
#include "nn/weights/matlab/mat_file.h"
#include "nn/weights/normalization.h"

namespace swarmcert::files {
namespace {

bool are_weights(const MatVariable& variable) { return variable.name == "weights" || variable.name == "W"; }

bool are_biases(const MatVariable& variable) {
  return variable.name == "biases" || variable.name == "bias" || variable.name == "b";
}

bool holds_layers(const MatVariable& variable) {
  return variable.array.has_value() || (variable.is_cell && are_weights(variable));
}

bool is_named(const MatVariable& variable, const std::set<std::string>& names) {
  return names.count(variable.name) == 1;
}

class MatNetwork {
 public:
  explicit MatNetwork(const std::string& path) : path_(path) {}

  Weights run(std::vector<MatVariable>& variables, const LayerChoice& choice) {
    for (MatVariable& variable : variables) take(variable);
    if (has_cells_)
      for (NamedArray& array : arrays_) others_.push_back(std::move(array));
    if (!has_cells_ && arrays_.empty())
      throw InputError(
          {path_, "", "", "", "holds neither a cell array \"weights\" nor numeric matrices", kSaveAgain});
    Weights weights = network_of_arrays(has_cells_ ? cells_ : arrays_, path_, choice);
    if (!activations_.empty()) weights = with_activation_of_file(std::move(weights), activations_, field_);
    if (!means_.empty() || !ranges_.empty()) {
      const auto size = static_cast<std::size_t>(weights.inputs()) + 1;
      if (means_.size() != size || ranges_.size() != size)
        throw InputError(
            {path_, "", "means_for_scaling", std::to_string(means_.size()) + " numbers",
             "a mean and a range per input and one for the outputs are needed, " + std::to_string(size),
             "save the matrices with their normalization folded"});
      weights = normalized(std::move(weights), means_, ranges_);
    }
    for (const NamedArray& other : others_) judge(other, weights);
    weights.unused.insert(weights.unused.end(), unused_.begin(), unused_.end());
    weights.assumed.insert(weights.assumed.end(), assumed_.begin(), assumed_.end());
    return weights;
  }

 private:
  void take(MatVariable& variable) {
    static const std::set<std::string> kActivations = {"act_fcns",    "act_fns",    "activation_fcns",
                                                       "activations", "activation", "act_functions"};
    static const std::set<std::string> kMeans = {"means_for_scaling", "mean_for_scaling"},
                                       kRanges = {"range_for_scaling", "ranges_for_scaling"};
    if (variable.is_cell && (are_weights(variable) || are_biases(variable))) {
      if (!variable.texts.empty())
        throw InputError(
            {path_, "", in_quotes(variable.name), "", "holds text between its matrices", kSaveAgain});
      has_cells_ = has_cells_ || are_weights(variable);
      for (std::size_t k = 0; k < variable.cells.size(); ++k) {
        variable.cells[k].name =
            "layer" + std::to_string(k + 1) + (are_biases(variable) ? ".bias" : ".weight");
        cells_.push_back(std::move(variable.cells[k]));
      }
    } else if (is_named(variable, kActivations)) {
      if (variable.texts.empty() || !variable.cells.empty())
        throw InputError({path_, "", in_quotes(variable.name), "", "is not text or a cell array of text",
                          "name one activation per layer: 'relu', 'tanh', 'linear'"});
      activations_ = variable.texts;
      field_ = variable.name;
    } else if (variable.array && is_named(variable, kMeans)) {
      means_ = variable.array->numbers;
    } else if (variable.array && is_named(variable, kRanges)) {
      ranges_ = variable.array->numbers;
    } else if (variable.array && is_known_number(*variable.array)) {
      others_.push_back(std::move(*variable.array));
    } else if (variable.array) {
      arrays_.push_back(std::move(*variable.array));
    } else {
      leave(variable.name);
    }
  }

  void leave(const std::string& name) {
    unused_.push_back(name + ": not known");
    assumed_.push_back("the variable " + in_quotes(name) + " does not bear on the function");
  }

  static bool is_known_number(const NamedArray& array) {
    static const std::set<std::string> kNames = {"number_of_layers",
                                                 "number_of_inputs",
                                                 "number_of_outputs",
                                                 "max_layer_size",
                                                 "layer_sizes",
                                                 "is_symmetric",
                                                 "min_inputs",
                                                 "max_inputs",
                                                 "inputSize",
                                                 "outputSize",
                                                 "nL",
                                                 "nI",
                                                 "nO"};
    return kNames.count(array.name) == 1;
  }

  /// Compares the counts that NNV's files state with the matrices.
  void judge(const NamedArray& other, const Weights& weights) {
    const auto require = [&](int found) {
      if (other.numbers.size() == 1 && other.numbers[0] == found)
        return unused_.push_back(other.name + ": agrees with the matrices");
      throw InputError({path_, "", in_quotes(other.name), "",
                        "contradicts the matrices, which give " + std::to_string(found), kSaveAgain});
    };
    const std::string& name = other.name;
    if (name == "number_of_layers" || name == "nL")
      return require(static_cast<int>(weights.stored_layers().size()));
    if (name == "number_of_inputs" || name == "nI" || name == "inputSize") return require(weights.inputs());
    if (name == "number_of_outputs" || name == "nO" || name == "outputSize")
      return require(weights.outputs());
    if (name == "min_inputs" || name == "max_inputs" || name == "is_symmetric" || name == "max_layer_size" ||
        name == "layer_sizes") {
      unused_.push_back(name + ": describes the inputs or the sizes, not the function");
    } else {
      leave(name);
    }
  }

  const std::string& path_;
  std::vector<NamedArray> cells_, arrays_, others_;
  bool has_cells_ = false;
  std::vector<std::string> activations_, unused_, assumed_;
  std::string field_;  ///< that states the activations
  std::vector<double> means_, ranges_;
};

}  // namespace

Weights parse_mat(const std::string& bytes, const std::string& path, const LayerChoice& choice) {
  std::vector<MatVariable> variables = mat_variables(bytes, path);
  std::string structure;
  const auto is_single = [](const MatVariable& variable) { return variable.is_struct; };
  if (std::none_of(variables.begin(), variables.end(), holds_layers) &&
      std::count_if(variables.begin(), variables.end(), is_single) == 1) {
    MatVariable only = std::move(*std::find_if(variables.begin(), variables.end(), is_single));
    structure = only.name;
    variables = std::move(only.fields);
  }
  Weights weights = MatNetwork(path).run(variables, choice);
  if (!structure.empty()) weights.notes.push_back("the network is the struct " + in_quotes(structure));
  return weights;
}

}  // namespace swarmcert::files
