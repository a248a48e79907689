/// @file Default uncertainty of a vehicle, used by `bound --uncertain` and the gate.
#pragma once

#include "stability/bounds/tracking_bounds.h"
#include "stability/bounds/uncertain/uncertain_norms.h"

namespace swarmcert::analysis {

inline Interval about(double value, double share) { return {value * (1 - share), value * (1 + share)}; }

/// Returns mass within 5 %, thrust scale within 10 %, motor lag and delay within 20 % of the values in model and gains.
inline stability::UncertainPlant usual_uncertainty(const stability::Gains& gains,
                                                   const stability::Plant& plant) {
  return {about(plant.mass_kg, 0.05), about(plant.thrust_scale, 0.1), about(gains.motor_lag_s, 0.2),
          about(gains.delay_s, 0.2)};
}

}  // namespace swarmcert::analysis
