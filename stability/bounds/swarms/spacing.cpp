#include "stability/bounds/swarms/spacing.h"

#include <algorithm>
#include <cmath>

#include "nn/base/doubles.h"
#include "stability/model.h"

namespace swarmcert::stability {
namespace {

/// Tracking errors of the lower vehicle under the field.
class LowerVehicle {
 public:
  LowerVehicle(const AxisLoop& loop, const GainNorms& gains, const SpacingVehicle& vehicle,
               const SpacingQuestion& question)
      : loop_(loop), gains_(gains), vehicle_(vehicle), question_(question) {
    if (std::isfinite(gains.amplitude)) pulse_ = std::min(pulse_gain(loop, Channel::kForce), 2 * gains.edge);
  }

  /// Error bound for any motion below the field, however slow.
  double stay_error_m(double force_N) const {
    const ClampBounds clamp = clamp_of(amplitude(force_N));
    return std::min(clamp.never_acts ? gains_.amplitude * force_N : kInfinity,
                    std::isinf(vehicle_.integrator_limit_m_s) ? kInfinity : clamp.by_amplitude);
  }

  /// Largest permanent force under which the bounds give at most max_error; for larger forces the clamp acts.
  double tolerated_N() const {
    const auto is_fine = [&](double force_N) {
      const ClampBounds clamp = clamp_of(amplitude(force_N));
      const double linear = clamp.never_acts ? gains_.amplitude * force_N : kInfinity;
      return std::min(linear, clamp.by_amplitude) <= question_.max_error_m;
    };
    double low = 0;
    double high = question_.max_error_m / gains_.amplitude;
    if (is_fine(high)) return high;
    for (int i = 0; i < 60; ++i) {
      const double middle = (low + high) / 2;
      (is_fine(middle) ? low : high) = middle;
    }
    return low;
  }

  /// The slowest pass whose error is bounded by max_error, by bisection, since all bounds decrease with speed.
  /// Infinite: none.
  double least_speed_m_s(double peak_N, double spread_m) const {
    const double impulse_at_1_m_s = peak_N * spread_m * std::sqrt(2 * std::acos(-1.0));
    const auto is_fine = [&](double speed_m_s) {
      Disturbance pass = amplitude(peak_N);
      pass.impulse_N_s = impulse_at_1_m_s / speed_m_s;
      const ClampBounds clamp = clamp_of(pass);
      const double linear = std::min(gains_.impulse * pass.impulse_N_s, pulse_ * peak_N);
      return std::min(clamp.never_acts ? linear : kInfinity,
                      std::isinf(vehicle_.integrator_limit_m_s) ? kInfinity : clamp.by_impulse) <=
             question_.max_error_m;
    };
    double slow = 1e-3;
    double fast = 1e3;
    if (!is_fine(fast)) return kInfinity;
    for (int k = 0; k < 60; ++k) {
      const double middle = std::sqrt(slow * fast);
      (is_fine(middle) ? fast : slow) = middle;
    }
    return fast;
  }

 private:
  static Disturbance amplitude(double force_N) {
    Disturbance d;
    d.amplitude_N = force_N;
    return d;
  }
  ClampBounds clamp_of(const Disturbance& d) const {
    return clamp_bounds(loop_, Channel::kForce, d, {}, vehicle_.integrator_limit_m_s,
                        vehicle_.integral_share);
  }

  const AxisLoop& loop_;
  const GainNorms& gains_;
  const SpacingVehicle& vehicle_;
  const SpacingQuestion& question_;
  double pulse_ = kInfinity;
};

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
  const LowerVehicle lower(loop, gains, vehicle, question);
  for (int i = 0; i < question.steps; ++i) {
    SpacingRow row;
    const double share = question.steps > 1 ? static_cast<double>(i) / (question.steps - 1) : 0;
    row.height_gap_m = question.from_m + share * (question.to_m - question.from_m);
    // Maximum of the field anywhere within the allowed error: the force decreases with the gap, the spread grows with
    // it.
    const double nearest_gap_m = row.height_gap_m - question.max_error_m;
    const double factor = question.guard * question.neighbours;
    row.peak_force_N = factor * field.peak_N(std::max(nearest_gap_m, 0.0));
    const double spread_m = field.spread_at_m(row.height_gap_m + question.max_error_m);
    row.thrust_margin_N =
        vehicle.largest_thrust_N - loop.mass_kg * kGravity_m_s2 - vehicle.effort_gain * row.peak_force_N;
    const bool has_thrust = row.thrust_margin_N >= 0 && nearest_gap_m > 0;
    row.stay_error_m = lower.stay_error_m(row.peak_force_N);
    row.may_stay = has_thrust && row.stay_error_m <= question.max_error_m;
    if (row.may_stay) {
      result.least_gap_to_stay_m = std::min(result.least_gap_to_stay_m, row.height_gap_m);
    } else {
      // The radius at which the field has decreased to the force that the bounds tolerate permanently.
      const double tolerated_N = lower.tolerated_N();
      row.keep_out_radius_m =
          tolerated_N > 0 ? spread_m * std::sqrt(2 * std::max(0.0, std::log(row.peak_force_N / tolerated_N)))
                          : kInfinity;
      row.least_speed_m_s = has_thrust ? lower.least_speed_m_s(row.peak_force_N, spread_m) : kInfinity;
    }
    if (std::isfinite(row.least_speed_m_s))
      result.least_gap_to_cross_m = std::min(result.least_gap_to_cross_m, row.height_gap_m);
    result.shape.push_back(row);
  }
  return result;
}

}  // namespace swarmcert::stability
