#include "stability/bounds/spacing.h"

#include <algorithm>
#include <cmath>

#include "nn/base/doubles.h"
#include "stability/model.h"

namespace swarmcert::stability {
namespace {

/// Largest force, held for ever, under which the bounds give at most max_error: the clamp acts for larger ones.
template <class ClampOf>
double linear_force_N(const ClampOf& clamp_of, const GainNorms& gains, const SpacingQuestion& question) {
  const auto is_fine = [&](double force_N) {
    Disturbance d;
    d.amplitude_N = force_N;
    const ClampBounds clamp = clamp_of(d);
    const double linear = clamp.never_acts ? gains.amplitude * force_N : kInfinity;
    return std::min(linear, clamp.by_amplitude) <= question.max_error_m;
  };
  double low = 0;
  double high = question.max_error_m / gains.amplitude;
  if (is_fine(high)) return high;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (is_fine(middle) ? low : high) = middle;
  }
  return low;
}

}  // namespace

double DownwashField::peak_N(double height_gap_m) const {
  return amplitude_N * std::pow(0.3 / std::max(height_gap_m, nearest_m), decay);
}

double DownwashField::spread_at_m(double height_gap_m) const {
  return spread_m + spread_slope * std::max(height_gap_m, nearest_m);
}

Spacing spacing(const AxisLoop& loop, const GainNorms& gains, const SpacingVehicle& vehicle,
                const DownwashField& field, const SpacingQuestion& question) {
  Spacing result;
  result.least_gap_to_stay_m = kInfinity;
  result.least_gap_to_cross_m = kInfinity;
  const double pulse = std::isfinite(gains.amplitude)
                           ? std::min(pulse_gain(loop, Channel::kForce), 2 * gains.edge)
                           : kInfinity;
  for (int i = 0; i < question.steps; ++i) {
    SpacingRow row;
    const double share = question.steps > 1 ? static_cast<double>(i) / (question.steps - 1) : 0;
    row.height_gap_m = question.from_m + share * (question.to_m - question.from_m);
    // Strongest anywhere within the error that is allowed: the force falls with the gap, the spread grows with it.
    const double nearest_gap_m = row.height_gap_m - question.max_error_m;
    const double farthest_gap_m = row.height_gap_m + question.max_error_m;
    const double factor = question.guard * question.neighbours;
    row.peak_force_N = factor * field.peak_N(std::max(nearest_gap_m, 0.0));
    const double spread_m = field.spread_at_m(farthest_gap_m);
    row.thrust_margin_N =
        vehicle.largest_thrust_N - loop.mass_kg * kGravity_m_s2 - vehicle.effort_gain * row.peak_force_N;
    const bool has_thrust = row.thrust_margin_N >= 0 && nearest_gap_m > 0;
    Disturbance below;
    below.amplitude_N = row.peak_force_N;
    const auto clamp_of = [&](const Disturbance& d) {
      return clamp_bounds(loop, Channel::kForce, d, {}, vehicle.integrator_limit_m_s, vehicle.integral_share);
    };
    const ClampBounds staying = clamp_of(below);
    row.stay_error_m = std::min(staying.never_acts ? gains.amplitude * row.peak_force_N : kInfinity,
                                std::isinf(vehicle.integrator_limit_m_s) ? kInfinity : staying.by_amplitude);
    row.may_stay = has_thrust && row.stay_error_m <= question.max_error_m;
    if (!row.may_stay) {
      // Beyond the radius at which the field has fallen to what the bounds tolerate for ever.
      const double tolerated_N = linear_force_N(clamp_of, gains, question);
      row.keep_out_radius_m =
          tolerated_N > 0 ? spread_m * std::sqrt(2 * std::max(0.0, std::log(row.peak_force_N / tolerated_N)))
                          : kInfinity;
      // The slowest pass whose error is bounded by max_error: bisect, all bounds fall with speed.
      const double impulse_at_1_m_s = row.peak_force_N * spread_m * std::sqrt(2 * std::acos(-1.0));
      const auto error_at = [&](double speed_m_s) {
        Disturbance pass = below;
        pass.impulse_N_s = impulse_at_1_m_s / speed_m_s;
        const ClampBounds clamp = clamp_of(pass);
        const double linear = std::min(gains.impulse * pass.impulse_N_s, pulse * row.peak_force_N);
        return std::min(clamp.never_acts ? linear : kInfinity,
                        std::isinf(vehicle.integrator_limit_m_s) ? kInfinity : clamp.by_impulse);
      };
      double slow = 1e-3;
      double fast = 1e3;
      row.least_speed_m_s = kInfinity;
      if (has_thrust && error_at(fast) <= question.max_error_m) {
        for (int k = 0; k < 60; ++k) {
          const double middle = std::sqrt(slow * fast);
          (error_at(middle) <= question.max_error_m ? fast : slow) = middle;
        }
        row.least_speed_m_s = fast;
      }
    }
    if (row.may_stay) result.least_gap_to_stay_m = std::min(result.least_gap_to_stay_m, row.height_gap_m);
    if (std::isfinite(row.least_speed_m_s)) {
      result.least_gap_to_cross_m = std::min(result.least_gap_to_cross_m, row.height_gap_m);
    }
    result.shape.push_back(row);
  }
  return result;
}

}  // namespace swarmcert::stability
