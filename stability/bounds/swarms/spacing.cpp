#include "stability/bounds/swarms/spacing.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "nn/base/doubles.h"
#include "stability/bounds/sampled_bounds.h"

namespace swarmcert::stability {
namespace {

/// The error of the lower vehicle under a lasting force F and passes of impulse J: linear in both.
class LowerVehicle {
 public:
  LowerVehicle(const FlownLoop& loop, double dwell_s) {
    Disturbance force, passes, nothing;
    force.amplitude_N = 1;
    nothing.amplitude_N = 0;
    passes.impulse_N_s = 1;
    passes.passes = Disturbance::kManyPasses;
    passes.pass_period_s = dwell_s;  // from the end of a pass, so that its length does not matter
    const ExactGains gains = flown_gains(loop, 2, Channel::kForce);
    const auto set = [&](const auto& one, double limit_m_s, double by_impulse) {
      const ClampBounds of_force = clamp_bounds(one, Channel::kForce, force, {}, limit_m_s);
      const ClampBounds of_passes = clamp_bounds(one, Channel::kForce, passes, {}, limit_m_s);
      linear_ = {gains.all_times.amplitude, by_impulse, 0};
      if (!of_force.exists) return;
      limit_m_s_ = limit_m_s;
      demand_ = {of_force.demand_m_s, of_passes.demand_m_s, 0};
      const double constant_m = clamp_bounds(one, Channel::kForce, nothing, {}, limit_m_s).by_amplitude;
      clamped_ = {of_force.by_amplitude - constant_m, of_passes.by_impulse - constant_m, constant_m};
    };
    if (const auto sampled = loop.sampled(2)) {
      set(*sampled, loop.integrator_limit_m_s(2),
          disturbance_bounds(*sampled, Channel::kForce, gains.all_times, passes).by_impulse);
    } else {
      const AxisLoop continuous = *loop.continuous(2);
      set(continuous, loop.integral_limit_m_s(2),
          disturbance_bounds(continuous, Channel::kForce, passes).by_impulse);
    }
  }

  double error_m(double force_N, double impulse_N_s) const {
    const double clamped_m = std::isfinite(limit_m_s_) ? clamped_.at(force_N, impulse_N_s) : kInfinity;
    if (demand_.at(force_N, impulse_N_s) > limit_m_s_) return clamped_m;
    return std::min(linear_.at(force_N, impulse_N_s), clamped_m);
  }

  /// Returns the largest x in [0, most] for which error(x) <= limit_m; 0 if there is none.
  template <class Error>
  static double largest(double most, double limit_m, const Error& error) {
    double low = 0, high = most;
    if (error(high) <= limit_m) return high;
    for (int i = 0; i < 60; ++i) {
      const double middle = (low + high) / 2;
      (error(middle) <= limit_m ? low : high) = middle;
    }
    return low;
  }

 private:
  struct Linear {
    double per_N = 0, per_N_s = 0, constant = 0;
    double at(double force_N, double impulse_N_s) const {
      return times(per_N, force_N) + times(per_N_s, impulse_N_s) + constant;
    }
    static double times(double gain, double size) { return size == 0 ? 0 : gain * size; }
  };
  Linear linear_, demand_, clamped_;
  double limit_m_s_ = kInfinity;
};

Saturation saturation_under(const FlownLoop& loop, double force_N) {
  DisturbanceSource source;
  source.kind = "declared";
  for (Disturbance& d : source.axis) d.amplitude_N = 0;
  source.axis[2].amplitude_N = force_N;
  return saturation(loop, source, {});
}

}  // namespace

double DownwashField::peak_N(double height_gap_m) const {
  return amplitude_N * std::pow(0.3 / std::max(height_gap_m, nearest_m), decay);
}

double DownwashField::spread_at_m(double height_gap_m) const {
  return spread_m + spread_slope * std::max(height_gap_m, nearest_m);
}

double DownwashField::spreads_at(double share) const {
  if (share >= 1) return 0;
  if (!(share > 0)) return kInfinity;
  return std::sqrt(2 * (tail > 0 ? (std::pow(share, -tail) - 1) / tail : -std::log(share)));
}

double DownwashField::line_integral() const {
  const double pi = std::acos(-1.0);
  if (tail == 0) return std::sqrt(2 * pi);
  return std::sqrt(2 * pi / tail) * std::exp(std::lgamma(1 / tail - 0.5) - std::lgamma(1 / tail));
}

Spacing spacing(const FlownLoop& loop, const DownwashField& field, const SpacingQuestion& question) {
  if (!loop.continuous(2)) throw std::invalid_argument("Lambda or K couples the z axis to others");
  Spacing result;
  result.least_gap_to_stay_m = kInfinity;
  result.least_gap_to_cross_m = kInfinity;
  const LowerVehicle lower(loop, question.dwell_s);
  const double limit_m = question.max_error_m;
  for (int i = 0; i < question.steps; ++i) {
    SpacingRow row;
    const double share = question.steps > 1 ? static_cast<double>(i) / (question.steps - 1) : 0;
    row.height_gap_m = question.from_m + share * (question.to_m - question.from_m);
    // Maximum of the field anywhere within the allowed error: the force decreases with the gap, the spread grows with
    // it.
    const double nearest_gap_m = row.height_gap_m - limit_m;
    row.peak_force_N = question.guard * question.neighbours * field.peak_N(std::max(nearest_gap_m, 0.0));
    const double spread_m = field.spread_at_m(row.height_gap_m + limit_m);
    const Saturation thrust = saturation_under(loop, row.peak_force_N);
    row.thrust_margin_N = thrust.margin_N();
    const bool has_thrust = thrust.is_proved() && nearest_gap_m > 0;
    row.stay_error_m = lower.error_m(row.peak_force_N, 0);
    row.may_stay = has_thrust && row.stay_error_m <= limit_m;
    if (row.may_stay) {
      result.least_gap_to_stay_m = std::min(result.least_gap_to_stay_m, row.height_gap_m);
    } else {
      const double outside_N = LowerVehicle::largest(
          row.peak_force_N, limit_m / 2, [&](double force_N) { return lower.error_m(force_N, 0); });
      const double at_1_m_s = row.peak_force_N * spread_m * field.line_integral();
      constexpr double kSlowest_m_s = 1e-3;
      const double impulse_N_s = LowerVehicle::largest(at_1_m_s / kSlowest_m_s, limit_m, [&](double impulse) {
        return lower.error_m(outside_N, impulse);
      });
      row.keep_out_radius_m = spread_m * field.spreads_at(outside_N / row.peak_force_N);
      row.least_speed_m_s =
          has_thrust && impulse_N_s > 0 && outside_N > 0 ? at_1_m_s / impulse_N_s : kInfinity;
    }
    if (std::isfinite(row.least_speed_m_s))
      result.least_gap_to_cross_m = std::min(result.least_gap_to_cross_m, row.height_gap_m);
    result.shape.push_back(row);
  }
  return result;
}

}  // namespace swarmcert::stability
