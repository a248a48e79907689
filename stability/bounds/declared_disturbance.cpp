#include "stability/bounds/declared_disturbance.h"

#include <algorithm>
#include <cmath>

#include "nn/base/doubles.h"
#include "nn/base/file_io.h"
#include "nn/base/file_keys.h"

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
  const char *unit, *meaning;
};

constexpr Key<Disturbance> kClasses[] = {
    {"rate_N_s", &Disturbance::rate_N_s, "N/s", "sup |f'| of the force error f."},
    {"amplitude_N", &Disturbance::amplitude_N, "N", "sup |f|."},
    {"variation_N", &Disturbance::variation_N, "N", "Total variation of f."},
    {"impulse_N_s", &Disturbance::impulse_N_s, "N s", "int |f| dt of one pass."}};
constexpr Key<EstimateError> kVelocity[] = {
    {"velocity_error_m_s", &EstimateError::amplitude, "m/s", "sup |estimated - true velocity|."},
    {"velocity_error_rate_m_s2", &EstimateError::rate, "m/s^2",
     "sup |d/dt (estimated - true velocity)|, from zero at the start."},
    {"velocity_error_variation_m_s", &EstimateError::variation, "m/s",
     "Total variation of (estimated - true velocity)."},
    {"velocity_error_impulse_m", &EstimateError::impulse, "m", "int |estimated - true velocity| dt."}};
constexpr Key<EstimateError> kPosition[] = {
    {"position_error_m", &EstimateError::amplitude, "m", "sup |estimated - true position|."},
    {"position_error_rate_m_s", &EstimateError::rate, "m/s",
     "sup |d/dt (estimated - true position)|, from zero at the start."},
    {"position_error_variation_m", &EstimateError::variation, "m",
     "Total variation of (estimated - true position)."},
    {"position_error_impulse_m_s", &EstimateError::impulse, "m s", "int |estimated - true position| dt."}};
constexpr Key<ReferenceMotion> kReference[] = {
    {"reference_step_m", &ReferenceMotion::steps_m, "m", "Sum of all jumps of the set point."},
    {"reference_speed_step_m_s", &ReferenceMotion::speed_steps_m_s, "m/s",
     "Sum of all jumps of the set point's velocity."},
    {"reference_accel_m_s2", &ReferenceMotion::acceleration_m_s2, "m/s^2",
     "sup |p_d''|, for the thrust that the fed-forward acceleration takes."},
    {"reference_jerk_m_s3", &ReferenceMotion::jerk_m_s3, "m/s^3",
     "sup |p_d'''| of a set point whose acceleration is fed forward."}};
constexpr const char* kDisturbanceSchema = "swarmcert/disturbance/1";

template <class KeysOfGroup>
void describe_group(files::Keys& keys, const KeysOfGroup& group) {
  for (const auto& key : group) keys.may<files::NumberOrThree>(key.name, key.meaning, key.unit);
}

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

void describe_classes(files::Keys& keys) { describe_group(keys, kClasses); }

void describe_force_error(files::Keys& keys) {
  describe_classes(keys);
  keys.may<files::NumberOrThree>("bias_N", "Constant part of the force error, on top of the rest.", "N");
}

void describe_disturbance_file(files::Keys& keys) {
  keys.schema(kDisturbanceSchema);
  describe_force_error(keys);
  keys.may<double>("thrust_ratio_error", "Largest constant error of the thrust ratio, as a fraction.");
  describe_group(keys, kVelocity);
  describe_group(keys, kPosition);
  describe_group(keys, kReference);
  keys.may<int>("passes", "Number of passes; needs impulse_N_s and every_s.");
  keys.may<double>("every_s", "Least time between the starts of two passes.", "s");
  keys.may<double>("pass_length_s", "How long one pass lasts.", "s");
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
  table.require_schema(kDisturbanceSchema);
  table.allow_only(files::key_names(describe_disturbance_file));
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
