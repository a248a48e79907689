#include "stability/effects/registry.h"

#include <algorithm>
#include <deque>
#include <functional>
#include <stdexcept>

#include "stability/effects/deep_set.h"
#include "stability/effects/downwash.h"
#include "stability/effects/effect_entry.h"
#include "stability/effects/expression.h"
#include "stability/effects/pendulum.h"

namespace swarmcert::stability {
namespace {

/// Each effect is one line. A deque keeps references valid when users add effects.
std::deque<EffectEntry>& entries() {
  static std::deque<EffectEntry> all = {effects::motor_lag(),
                                        effects::delay(),
                                        effects::sensor_delay(),
                                        effects::thrust_ratio(),
                                        effects::battery(),
                                        effects::drag_linear(),
                                        effects::drag_quadratic(),
                                        effects::drag_rotor(),
                                        effects::inflow(),
                                        effects::ground(),
                                        effects::ceiling(),
                                        effect_entry<Downwash>(),
                                        effects::upper_lift(),
                                        effects::constant_force(),
                                        effects::torque_bias(),
                                        effects::torque_ratio(),
                                        effects::rate_damping(),
                                        effects::rotor_momentum(),
                                        effects::flow_torque(),
                                        effects::downwash_torque(),
                                        effect_entry<DeepSetEffect>(),
                                        effects::voltage_sag(),
                                        effects::thrust_saturation(),
                                        effects::payload_step(),
                                        effects::translational_lift(),
                                        effects::wind_field(),
                                        effects::wall(),
                                        effects::vortex_ring(),
                                        effects::rotor_thrust(),
                                        effects::com_offset(),
                                        effects::imu_tilt(),
                                        effects::wake_delay(),
                                        effects::tether(),
                                        effects::accelerometer_scale(),
                                        effect_entry<Pendulum>()};
  return all;
}

std::deque<EffectEntry>::iterator place_of(const std::string& name) {
  return std::find_if(entries().begin(), entries().end(),
                      [&](const EffectEntry& entry) { return entry.info.name == name; });
}

const EffectEntry& find(const std::string& name) {
  const auto place = place_of(name);
  if (place == entries().end()) throw std::invalid_argument("there is no effect named " + name);
  return *place;
}

template <typename Is>
std::string first_with(const Is& is) {
  for (const EffectEntry& entry : entries()) {
    if (is(entry.info.traits)) return entry.info.name;
  }
  throw std::invalid_argument("the library lacks an effect that identification needs");
}

}  // namespace

std::vector<std::string> effect_names() {
  std::vector<std::string> names;
  for (const EffectEntry& entry : entries()) names.push_back(entry.info.name);
  return names;
}

void register_effect(EffectInfo info, EffectMaker make) {
  const std::vector<std::string> names = effect_names();
  if (info.name.empty() || std::find(names.begin(), names.end(), info.name) != names.end())
    throw std::invalid_argument("register_effect: the name '" + info.name + "' is empty or taken");
  if (info.linear.empty() || info.linear.size() > kMostColumns || info.shape.size() > kMostShape)
    throw std::invalid_argument("register_effect: " + info.name +
                                " must have 1 to 8 coefficients and at most 8 shape parameters");
  if (info.equivalence_class.empty()) info.equivalence_class = info.name;
  entries().push_back({std::move(info), std::move(make)});
}

EffectEntry withdraw_effect(const std::string& name) {
  EffectEntry entry = find(name);
  entries().erase(place_of(name));
  return entry;
}

const EffectInfo& effect_info(const std::string& name) { return find(name).info; }

const EffectTraits& traits_of(const std::string& name) {
  static const EffectTraits ordinary;
  const auto place = place_of(name);
  return place == entries().end() ? ordinary : place->info.traits;
}

std::string plain_effect(Family family) {
  return first_with([&](const EffectTraits& traits) { return traits.is_plain(family); });
}

std::string effect_shown_by(ShownBy data) {
  return first_with([&](const EffectTraits& traits) { return traits.shown_by == data; });
}

std::unique_ptr<Effect> make_effect(const EffectSpec& spec, const EffectContext& context) {
  if (spec.is_expression()) return std::make_unique<ExpressionEffect>(spec, context.path);
  return find(spec.name).make(spec, context);
}

double size_of(Unit unit, const Model& model) {
  const double body_m = 2 * model.arm_m;
  switch (unit) {
    case Unit::kOwn:
      return 1;
    case Unit::kWeight:
      return model.weight_N();
    case Unit::kMass:
      return model.mass_kg;
    case Unit::kArm:
      return model.arm_m;
    case Unit::kWeightArm:
      return model.weight_N() * model.arm_m;
    case Unit::kWeightPerArm:
      return model.weight_N() / model.arm_m;
    case Unit::kDrag:
      return model.weight_N() / body_m;
    case Unit::kSquaredDrag:
      return model.weight_N() / (body_m * body_m);
    case Unit::kPerBattery:
      return 1 / model.battery_range_V.upper;
  }
  return 1;
}

std::string size_words(Unit unit) {
  switch (unit) {
    case Unit::kOwn:
      return "";
    case Unit::kWeight:
      return "the weight";
    case Unit::kMass:
      return "the mass";
    case Unit::kArm:
      return "the arm";
    case Unit::kWeightArm:
      return "weight times arm";
    case Unit::kWeightPerArm:
      return "weight over arm";
    case Unit::kDrag:
      return "weight over body length";
    case Unit::kSquaredDrag:
      return "weight over squared body length";
    case Unit::kPerBattery:
      return "the inverse of the largest voltage";
  }
  return "";
}

EffectInfo effect_info(const std::string& name, const Model& model) {
  EffectInfo info = find(name).info;
  for (std::vector<Parameter>* parameters : {&info.linear, &info.shape}) {
    for (Parameter& parameter : *parameters) {
      const double size = size_of(parameter.unit, model);
      parameter.lower *= size;
      parameter.upper *= size;
    }
  }
  return info;
}

EffectValues effect_values(const EffectInfo& info, const EffectSpec& spec) {
  const auto values = [&spec](const std::vector<Parameter>& parameters) {
    std::vector<double> result;
    for (const Parameter& parameter : parameters) {
      const auto stated = spec.parameters.find(parameter.name);
      result.push_back(stated == spec.parameters.end() ? parameter.value : stated->second);
    }
    return result;
  };
  return {values(info.linear), values(info.shape)};
}

double effect_value(const EffectSpec& spec, const std::string& name) {
  const auto stated = spec.parameters.find(name);
  if (stated != spec.parameters.end()) return stated->second;
  const EffectInfo& info = effect_info(spec.name);
  for (const std::vector<Parameter>* const parameters : {&info.linear, &info.shape})
    for (const Parameter& parameter : *parameters)
      if (parameter.name == name) return parameter.value;
  throw std::logic_error(spec.name + " has no parameter " + name);
}

}  // namespace swarmcert::stability
