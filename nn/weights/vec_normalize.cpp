#include "nn/weights/vec_normalize.h"

#include <cmath>
#include <filesystem>
#include <vector>

#include "nn/base/doubles.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/weights/normalization.h"
#include "nn/weights/pickle.h"
#include "nn/weights/tensors.h"

namespace swarmcert::files {
namespace {

using Kind = PickledValue::Kind;

/// The attributes of a pickled VecNormalize.
class VecNormalize {
 public:
  VecNormalize(const std::string& bytes, const std::string& path)
      : pickle_(parse_pickle(bytes, 0, path, "")), path_(path) {
    const PickledValue& state = state_of(pickle_.values[pickle_.root], "");
    is_on = get(state, "norm_obs").integer != 0;
    epsilon = number(state, "epsilon");
    clip = number(state, "clip_obs");
    if (!is_on) return;
    const PickledValue& statistics = state_of(get(state, "obs_rms"), "obs_rms");
    mean = numbers(statistics, "mean");
    variance = numbers(statistics, "var");
    if (mean.size() != variance.size()) refuse("obs_rms.var", "is not as long as the mean");
    for (const double one : variance)
      if (one + epsilon <= 0) refuse("obs_rms.var", "is not positive");
    if (!(clip > 0)) refuse("clip_obs", "is not positive");
  }

  bool is_on = false;
  double epsilon = 0, clip = 0;
  std::vector<double> mean, variance;

 private:
  [[noreturn]] void refuse(const std::string& field, const std::string& what) const {
    throw InputError({path_, "", field, "", what,
                      "name a file that VecNormalize.save() wrote for the observations of this policy"});
  }

  const PickledValue& state_of(const PickledValue& object, const std::string& field) const {
    if (object.kind == Kind::kDict && !field.empty())
      refuse(field, "is of several observations, by name, which no plain network takes");
    if (object.kind != Kind::kOpaque || object.items.size() != 1 ||
        pickle_.values[object.items[0]].kind != Kind::kDict)
      refuse(field, "is not an object with attributes");
    return pickle_.values[object.items[0]];
  }

  const PickledValue& get(const PickledValue& dict, const std::string& key) const {
    for (std::size_t i = 0; i + 1 < dict.items.size(); i += 2)
      if (pickle_.values[dict.items[i]].text == key) return pickle_.values[dict.items[i + 1]];
    refuse(key, "is not there: this is no VecNormalize");
  }

  double number(const PickledValue& dict, const std::string& key) const {
    const PickledValue& value = get(dict, key);
    if (value.kind == Kind::kInteger) return static_cast<double>(value.integer);
    if (value.kind != Kind::kReal || std::isnan(value.real)) refuse(key, "is not a number");
    return value.real;
  }

  std::vector<double> numbers(const PickledValue& dict, const std::string& key) const {
    const PickledValue& value = get(dict, key);
    if (value.kind != Kind::kTensor) refuse(key, "is not an array");
    const PickledTensor& tensor = pickle_.tensors[static_cast<std::size_t>(value.integer)];
    const PickledStorage& storage = pickle_.storages[tensor.storage];
    if (!storage.is_inline || tensor.sizes.size() != 1 ||
        (storage.type != "DoubleStorage" && storage.type != "FloatStorage"))
      refuse(key, "is not a list of floating-point numbers");
    std::vector<double> result;
    append_numbers(storage.bytes.data(), tensor.sizes[0], 1,
                   storage.type == "DoubleStorage" ? Precision::kFloat64 : Precision::kFloat32, result);
    for (const double one : result)
      if (!std::isfinite(one)) refuse(key, "is not finite");
    return result;
  }

  const Pickle pickle_;
  const std::string& path_;
};

}  // namespace

std::string vec_normalize_beside(const std::string& path) {
  const std::filesystem::path policy(path);
  for (const char* const name : {"vec_normalize.pkl", "vecnormalize.pkl"})
    if (policy.extension() == ".zip" && std::filesystem::exists(policy.parent_path() / name))
      return (policy.parent_path() / name).string();
  return "";
}

std::string from_folder_of(const std::string& file, const std::string& path) {
  const auto absolute = [](const std::filesystem::path& place) {
    return std::filesystem::absolute(place).lexically_normal();
  };
  return absolute(path).lexically_proximate(absolute(file).parent_path()).generic_string();
}

Network with_vec_normalize(Network network, const std::string& path) {
  const std::string bytes = read_file(path);
  const VecNormalize normalization(bytes, path);
  Weights& weights = network.plain.value();
  const std::string name = std::filesystem::path(path).filename().string();
  weights.data_files.emplace_back(from_folder_of(weights.path, path), sha256(bytes));
  if (!normalization.is_on) {
    weights.notes.push_back(name + " states that observations are not normalized");
    return network;
  }
  const std::vector<double>& mean = normalization.mean;
  if (mean.size() != static_cast<std::size_t>(weights.inputs()))
    throw InputError({path, "", "obs_rms.mean", std::to_string(mean.size()) + " numbers",
                      "the network has " + std::to_string(weights.inputs()) + " inputs",
                      "name the file of this policy, or --normalization none"});
  std::vector<Enclosed> means, deviations;
  InputClamp clamp;
  for (std::size_t i = 0; i < mean.size(); ++i) {
    ExactSum variance;
    variance.add({normalization.variance[i], 0});
    variance.add({normalization.epsilon, 0});
    means.push_back({mean[i], 0});
    deviations.push_back(square_root(variance.value()));
    for (const double side : {-normalization.clip, normalization.clip}) {
      ExactSum end;
      end.add(means.back());
      end.add_product({side, 0}, deviations.back());
      const Enclosed bound = end.value();
      if (side < 0) clamp.lower.push_back(bound.radius > 0 ? down(bound.value - bound.radius) : bound.value);
      if (side > 0) clamp.upper.push_back(bound.radius > 0 ? up(bound.value + bound.radius) : bound.value);
    }
  }
  weights = with_normalized_inputs(std::move(weights), means, deviations);
  weights.notes.push_back("inputs are observations, normalized by the means and variances of " + name +
                          ": folded into the first layer");
  if (!std::isfinite(normalization.clip)) return network;
  weights.notes.push_back("its clip of normalized observations is the input clamp");
  network.clamp = std::move(clamp);
  return network;
}

}  // namespace swarmcert::files
