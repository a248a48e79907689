#include "stability/bounds/declared_disturbance.h"

#include <algorithm>
#include <cmath>

#include "nn/base/doubles.h"
#include "nn/base/file_io.h"

namespace swarmcert::stability {
namespace {

/// Returns the numbers of the axes; `otherwise` if the key is missing.
PerAxis of_axes(const files::TomlTable& table, const std::string& key, double otherwise) {
  PerAxis values;
  values.fill(otherwise);
  if (!table.has(key)) return values;
  if (table.is_list(key)) {
    const std::vector<double> list = table.numbers(key);
    if (list.size() != values.size())
      table.refuse(key, std::to_string(list.size()) + " numbers", "needs one number for all axes, or three");
    std::copy(list.begin(), list.end(), values.begin());
  } else {
    values.fill(table.number(key));
  }
  for (const double value : values)
    if (value < 0) table.refuse(key, std::to_string(value), "must not be negative");
  return values;
}

/// One key and the member that it sets on every axis.
template <class Of>
struct Key {
  const char* name;
  double Of::*member;
};

constexpr Key<Disturbance> kClasses[] = {{"rate_N_s", &Disturbance::rate_N_s},
                                         {"amplitude_N", &Disturbance::amplitude_N},
                                         {"variation_N", &Disturbance::variation_N},
                                         {"impulse_N_s", &Disturbance::impulse_N_s}};
constexpr Key<EstimateError> kVelocity[] = {{"velocity_error_m_s", &EstimateError::amplitude},
                                            {"velocity_error_rate_m_s2", &EstimateError::rate},
                                            {"velocity_error_variation_m_s", &EstimateError::variation},
                                            {"velocity_error_impulse_m", &EstimateError::impulse}};
constexpr Key<EstimateError> kPosition[] = {{"position_error_m", &EstimateError::amplitude},
                                            {"position_error_rate_m_s", &EstimateError::rate},
                                            {"position_error_variation_m", &EstimateError::variation},
                                            {"position_error_impulse_m_s", &EstimateError::impulse}};
constexpr Key<ReferenceMotion> kReference[] = {
    {"reference_step_m", &ReferenceMotion::steps_m},
    {"reference_speed_step_m_s", &ReferenceMotion::speed_steps_m_s},
    {"reference_accel_m_s2", &ReferenceMotion::acceleration_m_s2},
    {"reference_jerk_m_s3", &ReferenceMotion::jerk_m_s3}};

template <class Keys>
bool states_any(const files::TomlTable& table, const Keys& keys) {
  return std::any_of(std::begin(keys), std::end(keys), [&](const auto& key) { return table.has(key.name); });
}

/// Sets the members whose keys are stated.
template <class Keys, class Of>
void read_axes(const files::TomlTable& table, const Keys& keys, Of (&axes)[3]) {
  for (const auto& key : keys) {
    if (!table.has(key.name)) continue;
    const PerAxis values = of_axes(table, key.name, 0);
    for (std::size_t axis = 0; axis < 3; ++axis) axes[axis].*key.member = values[axis];
  }
}

/// What is stated about an estimate replaces all that was known of it.
template <class Keys>
bool read_estimate(const files::TomlTable& table, const Keys& keys, EstimateError (&axes)[3]) {
  if (!states_any(table, keys)) return false;
  for (EstimateError& error : axes) {
    error = {};
    error.amplitude = kInfinity;
  }
  read_axes(table, keys, axes);
  return true;
}

void read_passes(const files::TomlTable& table, DisturbanceSource& source) {
  const auto seconds = [&table](const char* key) { return of_axes(table, key, 0)[0]; };
  if (!table.has("passes")) return;
  const double passes = table.number("passes");
  if (!(passes >= 1) || passes != std::floor(passes) || passes > 1e6)
    table.refuse("passes", std::to_string(passes), "must be a whole number from 1");
  if (passes > 1 && !(table.has("every_s") && table.has("impulse_N_s")))
    table.refuse("passes", "", "repeats the impulse of one pass", "state impulse_N_s and every_s");
  for (Disturbance& d : source.axis) {
    d.passes = static_cast<int>(passes);
    d.pass_period_s = seconds("every_s");
    d.pass_length_s = seconds("pass_length_s");
  }
}

}  // namespace

std::vector<std::string> class_keys() {
  std::vector<std::string> keys;
  for (const Key<Disturbance>& key : kClasses) keys.emplace_back(key.name);
  return keys;
}

void read_force_error(const files::TomlTable& table, DisturbanceSource& source) {
  if (states_any(table, kClasses)) {
    source.kind = "declared";
    read_axes(table, kClasses, source.axis);
  }
  if (table.has("rate_N_s")) {
    // One number bounds the vector as well.
    const PerAxis rate = of_axes(table, "rate_N_s", 0);
    source.rate_norm_N_s = table.is_list("rate_N_s") ? std::hypot(rate[0], rate[1], rate[2]) : rate[0];
  }
  if (!table.has("bias_N")) return;
  const PerAxis bias = of_axes(table, "bias_N", 0);
  for (std::size_t axis = 0; axis < 3; ++axis)
    source.bias_N[axis] = std::abs(source.bias_N[axis]) + bias[axis];
  source.classes_contain_bias = false;
}

void read_disturbance_file(const std::string& path, DisturbanceSource& source) {
  const toml::table document = files::parse_toml(files::read_file(path), path);
  const files::TomlTable table(document, path);
  table.require_schema("swarmcert/disturbance/1");
  std::vector<std::string> known = class_keys();
  const auto add = [&known](const auto& keys) {
    for (const auto& key : keys) known.emplace_back(key.name);
  };
  add(kVelocity), add(kPosition), add(kReference);
  for (const char* const key :
       {"schema", "bias_N", "thrust_ratio_error", "passes", "every_s", "pass_length_s"})
    known.emplace_back(key);
  table.allow_only(known);
  read_force_error(table, source);
  if (source.kind == "declared") source.note = "as " + path + " declares";
  constexpr double kMostRatioError = 0.9;
  if (table.has("thrust_ratio_error")) source.thrust_ratio_error = table.number("thrust_ratio_error");
  if (!(source.thrust_ratio_error >= 0 && source.thrust_ratio_error <= kMostRatioError))
    table.refuse("thrust_ratio_error", std::to_string(source.thrust_ratio_error), "must be from 0 to 0.9");
  source.declares_velocity_error = read_estimate(table, kVelocity, source.velocity_error);
  read_estimate(table, kPosition, source.position_error);
  read_axes(table, kReference, source.reference);
  read_passes(table, source);
}

}  // namespace swarmcert::stability
