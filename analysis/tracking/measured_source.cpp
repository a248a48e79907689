#include "analysis/tracking/measured_source.h"

#include <cmath>

namespace swarmcert::analysis {

stability::DisturbanceSource measured_source(const std::array<MeasuredAxis, 3>& force, double window_s) {
  stability::DisturbanceSource source;
  source.kind = "measured";
  double square = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const MeasuredAxis& measured = force[static_cast<std::size_t>(axis)];
    stability::Disturbance& d = source.axis[axis];
    d.rate_N_s = measured.rate;
    d.amplitude_N = measured.amplitude;
    d.variation_N = measured.variation;
    d.impulse_N_s = measured.impulse;
    if (window_s > 0) {
      d.passes = stability::Disturbance::kManyPasses;
      d.pass_period_s = d.pass_length_s = window_s;
      d.variation_per_pass = true;
    }
    source.bias_N[axis] = std::isfinite(measured.bias) ? measured.bias : 0;
    square += d.rate_N_s * d.rate_N_s;
  }
  // From quantiles per axis: at least the norm of the vector if the quantiles are attained together.
  source.rate_norm_N_s = std::sqrt(square);
  source.classes_contain_bias = source.amplitudes_reach_bias();
  return source;
}

stability::EstimateError measured_estimate(const MeasuredAxis& error, double window_s) {
  stability::EstimateError n;
  n.amplitude = error.amplitude < error.bias ? error.amplitude + error.bias : error.amplitude;
  n.rate = error.rate;
  n.variation = error.variation;
  n.impulse = error.impulse;
  n.constant = error.bias;
  n.window_s = window_s;
  return n;
}

}  // namespace swarmcert::analysis
