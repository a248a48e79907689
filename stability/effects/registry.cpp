#include "stability/effects/registry.h"

#include <algorithm>
#include <deque>
#include <functional>
#include <stdexcept>

#include "stability/effects/accelerometer_scale.h"
#include "stability/effects/battery.h"
#include "stability/effects/ceiling.h"
#include "stability/effects/com_offset.h"
#include "stability/effects/constant_force.h"
#include "stability/effects/deep_set.h"
#include "stability/effects/delay.h"
#include "stability/effects/downwash.h"
#include "stability/effects/downwash_torque.h"
#include "stability/effects/drag_linear.h"
#include "stability/effects/drag_quadratic.h"
#include "stability/effects/drag_rotor.h"
#include "stability/effects/expression.h"
#include "stability/effects/ground.h"
#include "stability/effects/imu_tilt.h"
#include "stability/effects/inflow.h"
#include "stability/effects/motor_lag.h"
#include "stability/effects/payload_step.h"
#include "stability/effects/pendulum.h"
#include "stability/effects/rotor_thrust.h"
#include "stability/effects/sensor_delay.h"
#include "stability/effects/tether.h"
#include "stability/effects/thrust_ratio.h"
#include "stability/effects/thrust_saturation.h"
#include "stability/effects/torque_bias.h"
#include "stability/effects/translational_lift.h"
#include "stability/effects/upper_lift.h"
#include "stability/effects/voltage_sag.h"
#include "stability/effects/vortex_ring.h"
#include "stability/effects/wake_delay.h"
#include "stability/effects/wall.h"
#include "stability/effects/wind_field.h"

namespace swarmcert::stability {
namespace {

struct Entry {
  EffectInfo info;
  EffectMaker make;
};

template <typename T>
Entry entry() {
  return {T::describe(), [](const EffectSpec& spec, const EffectContext& context) -> std::unique_ptr<Effect> {
            if constexpr (std::is_constructible_v<T, const EffectSpec&, const EffectContext&>) {
              return std::make_unique<T>(spec, context);
            } else {
              return std::make_unique<T>();
            }
          }};
}

/// A new effect is one line here.
std::deque<Entry>& entries() {
  static std::deque<Entry> all = {
      // a deque keeps references when users add theirs
      entry<MotorLag>(),         entry<Delay>(),         entry<SensorDelay>(),
      entry<ThrustRatio>(),      entry<Battery>(),       entry<DragLinear>(),
      entry<DragQuadratic>(),    entry<DragRotor>(),     entry<Inflow>(),
      entry<Ground>(),           entry<Ceiling>(),       entry<Downwash>(),
      entry<UpperLift>(),        entry<ConstantForce>(), entry<TorqueBias>(),
      entry<DownwashTorque>(),   entry<DeepSetEffect>(), entry<VoltageSag>(),
      entry<ThrustSaturation>(), entry<PayloadStep>(),   entry<TranslationalLift>(),
      entry<WindField>(),        entry<Wall>(),          entry<VortexRing>(),
      entry<RotorThrust>(),      entry<ComOffset>(),     entry<ImuTilt>(),
      entry<WakeDelay>(),        entry<Tether>(),        entry<AccelerometerScale>(),
      entry<Pendulum>(),
  };
  return all;
}

const Entry& find(const std::string& name) {
  for (const Entry& entry : entries()) {
    if (entry.info.name == name) return entry;
  }
  throw std::invalid_argument("there is no effect named " + name);
}

}  // namespace

std::vector<std::string> effect_names() {
  std::vector<std::string> names;
  for (const Entry& entry : entries()) names.push_back(entry.info.name);
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

const EffectInfo& effect_info(const std::string& name) { return find(name).info; }

std::unique_ptr<Effect> make_effect(const EffectSpec& spec, const EffectContext& context) {
  if (spec.is_expression()) return std::make_unique<ExpressionEffect>(spec, context.path);
  return find(spec.name).make(spec, context);
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

}  // namespace swarmcert::stability
