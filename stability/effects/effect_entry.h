/// @file Registry entries, and the built-in effects whose classes are local to their source files.
#pragma once

#include <memory>
#include <type_traits>

#include "stability/effects/registry.h"

namespace swarmcert::stability {

/// Returns the entry of a class with a default constructor, or with describe() and a constructor from the model file's
/// entry.
template <typename T>
EffectEntry effect_entry() {
  if constexpr (std::is_default_constructible_v<T>) {
    return {T().info(), [](const EffectSpec&, const EffectContext&) { return std::make_unique<T>(); }};
  } else {
    return {T::describe(), [](const EffectSpec& spec, const EffectContext& context) {
              return std::make_unique<T>(spec, context);
            }};
  }
}

/// Each is defined in the source file of the same name.
namespace effects {
EffectEntry accelerometer_scale();
EffectEntry battery();
EffectEntry ceiling();
EffectEntry com_offset();
EffectEntry constant_force();
EffectEntry delay();
EffectEntry downwash_torque();
EffectEntry drag_linear();
EffectEntry drag_quadratic();
EffectEntry drag_rotor();
EffectEntry flow_torque();
EffectEntry ground();
EffectEntry imu_tilt();
EffectEntry inflow();
EffectEntry motor_lag();
EffectEntry payload_step();
EffectEntry rate_damping();
EffectEntry rotor_momentum();
EffectEntry rotor_thrust();
EffectEntry sensor_delay();
EffectEntry tether();
EffectEntry thrust_ratio();
EffectEntry thrust_saturation();
EffectEntry torque_bias();
EffectEntry torque_ratio();
EffectEntry translational_lift();
EffectEntry upper_lift();
EffectEntry voltage_sag();
EffectEntry vortex_ring();
EffectEntry wake_delay();
EffectEntry wall();
EffectEntry wind_field();
}  // namespace effects

}  // namespace swarmcert::stability
