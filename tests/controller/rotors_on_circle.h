/// @file Rotor layouts for tests of the mixer.
#pragma once

#include "controller/mixing.h"
#include "controller/trigonometry.h"

namespace swarmcert::controller {

/// Returns `count` rotors on a circle, the first at `first_angle_rad` from x towards y and the others following in that
/// direction, with torques alternating from +torque_per_thrust_m. Three rotors represent a tricopter without its
/// tilting rotor, whose yaw cannot be controlled. Returns no rotors for a count outside 3 to kMostRotors.
template <typename Scalar>
inline Rotors<Scalar> rotors_on_circle(int count, Scalar arm_m, Scalar first_angle_rad,
                                       Scalar torque_per_thrust_m) {
  Rotors<Scalar> rotors;
  if (count < 3 || count > kMostRotors) return rotors;
  rotors.count = count;
  for (int i = 0; i < count; ++i) {
    const Scalar angle = first_angle_rad + product(static_cast<Scalar>(i),
                                                   Scalar(6.28318530717958648) / static_cast<Scalar>(count));
    const SineCosine<Scalar> s = sin_cos(angle);
    rotors.at[i] = {product(arm_m, s.cosine), product(arm_m, s.sine),
                    i % 2 == 0 ? torque_per_thrust_m : -torque_per_thrust_m};
  }
  return rotors;
}

}  // namespace swarmcert::controller
