#include "stability/bounds/disturbance_source.h"

#include <algorithm>
#include <cmath>

namespace swarmcert::stability {

bool DisturbanceSource::has_estimate_errors() const {
  const auto is_given = [](const EstimateError& error) { return !error.is_zero(); };
  return std::any_of(std::begin(velocity_error), std::end(velocity_error), is_given) ||
         std::any_of(std::begin(position_error), std::end(position_error), is_given);
}

bool DisturbanceSource::has_moving_reference() const {
  return std::any_of(std::begin(reference), std::end(reference),
                     [](const ReferenceMotion& motion) { return !(motion == ReferenceMotion{}); });
}

bool DisturbanceSource::amplitudes_reach_bias() const {
  for (std::size_t i = 0; i < 3; ++i) {
    if (std::abs(bias_N[i]) > axis[i].amplitude_N) return false;
  }
  return true;
}

OtherErrors DisturbanceSource::other(int of_axis, const InitialError& initial, const Plant& plant) const {
  OtherErrors errors;
  errors.bias_N = bias_N[of_axis];
  errors.start_N = initial.learning_error_N;
  errors.position_m = initial.position_m;
  errors.velocity_m_s = initial.velocity_m_s;
  errors.reference = reference[of_axis];
  errors.velocity_error = velocity_error[of_axis];
  errors.position_error = position_error[of_axis];
  errors.thrust_ratio_error = thrust_ratio_error;
  if (of_axis == 2 && thrust_ratio_error > 0)
    errors.hover_N = plant.thrust_scale * plant.mass_kg * kGravity_m_s2;
  return errors;
}

void declare_no_class(DisturbanceSource& source) {
  source.kind = "declared";
  source.note = "as given; no force error other than a constant one";
  for (Disturbance& d : source.axis)
    d.amplitude_N = d.variation_N = d.impulse_N_s = 0;  // the rate of a constant force is zero
  source.rate_norm_N_s = 0;
}

}  // namespace swarmcert::stability
