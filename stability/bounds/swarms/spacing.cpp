#include "stability/bounds/swarms/spacing.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "nn/base/doubles.h"
#include "stability/bounds/sampled_bounds.h"

namespace swarmcert::stability {
namespace {

/// The error and the feedback of the lower vehicle under a lasting force F and passes of impulse J, beside what else is
/// declared: linear in both.
class LowerVehicle {
 public:
  LowerVehicle(const FlownLoop& loop, double dwell_s, const DisturbanceSource& beside) {
    Disturbance force, passes, nothing;
    force.amplitude_N = 1;
    nothing.amplitude_N = 0;
    passes.impulse_N_s = 1;
    passes.passes = Disturbance::kManyPasses;
    passes.pass_period_s = dwell_s;  // from the end of a pass, so that its length does not matter
    const ExactGains gains = flown_gains(loop, 2, Channel::kForce);
    const AxisBounds others = axis_bounds(loop, gains, beside, {});
    const OtherErrors other = beside.other(2, {}, loop.plant);
    const auto effort = [&](const auto& one, double constant_N) -> Linear {
      return {effort_of_class_N(one, Channel::kForce, force), effort_of_class_N(one, Channel::kForce, passes),
              constant_N + effort_of_class_N(one, Channel::kForce, beside.axis[2]) + effort_N(one, other) +
                  loop.plant.mass_kg * other.reference.fed_forward_m_s2()};
    };
    const auto set = [&](auto one, double limit_m_s, double by_impulse) {
      const ClampBounds of_force = clamp_bounds(one, Channel::kForce, force, {}, limit_m_s);
      const ClampBounds of_passes = clamp_bounds(one, Channel::kForce, passes, {}, limit_m_s);
      linear_ = {gains.all_times.amplitude, by_impulse, others.bounds.least()};
      effort_ = effort(one, 0);
      if (!of_force.exists) return;
      limit_m_s_ = limit_m_s;
      demand_ = {of_force.demand_m_s, of_passes.demand_m_s, others.clamp.demand_m_s};
      const double constant_m = clamp_bounds(one, Channel::kForce, nothing, {}, limit_m_s).by_amplitude;
      clamped_ = {of_force.by_amplitude - constant_m, of_passes.by_impulse - constant_m,
                  std::min(others.clamp.by_amplitude, others.clamp.by_impulse)};
      const double integral_N = replace_integral_N(one, limit_m_s);
      clamped_effort_ = effort(one, integral_N);
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

  /// Returns sup |u| of the feedback.
  double feedback_N(double force_N, double impulse_N_s) const {
    const bool may_clamp = demand_.at(force_N, impulse_N_s) > limit_m_s_;
    return (may_clamp ? clamped_effort_ : effort_).at(force_N, impulse_N_s);
  }

 private:
  struct Linear {
    double per_N = 0, per_N_s = 0, constant = 0;
    double at(double force_N, double impulse_N_s) const {
      return times(per_N, force_N) + times(per_N_s, impulse_N_s) + constant;
    }
    static double times(double gain, double size) { return size == 0 ? 0 : gain * size; }
  };
  Linear linear_, demand_, clamped_, effort_, clamped_effort_;
  double limit_m_s_ = kInfinity;
};

/// Returns the largest allowed x in [0, most]; 0 if none is allowed. Precondition: below an allowed x, all are allowed.
template <class Allowed>
double largest_allowed(double most, const Allowed& allowed) {
  if (allowed(most)) return most;
  double low = 0, high = most;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (allowed(middle) ? low : high) = middle;
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

Spacing spacing(const FlownLoop& loop, const DownwashField& field, const DisturbanceSource& beside,
                const SpacingQuestion& question) {
  if (!loop.continuous(2)) throw std::invalid_argument("Lambda or K couples the z axis to others");
  if (beside.thrust_ratio_error > 0)
    throw std::invalid_argument("an error of the thrust ratio is not contained");
  Spacing result;
  result.least_gap_to_stay_m = kInfinity;
  result.least_gap_to_cross_m = kInfinity;
  const LowerVehicle lower(loop, question.dwell_s, beside);
  const PerAxis sideways = thrust_demand(loop, beside, {}).feedback_N;
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
    // No force is larger than the peak, so that staying below also bounds the feedback of a pass.
    const double stay_N = lower.feedback_N(row.peak_force_N, 0);
    const auto thrust = [&](double force_N, double impulse_N_s) {
      return saturation_of(
          loop, {sideways[0], sideways[1], std::min(stay_N, lower.feedback_N(force_N, impulse_N_s))});
    };
    const auto holds = [&](double force_N, double impulse_N_s) {
      return lower.error_m(force_N, impulse_N_s) <= limit_m && thrust(force_N, impulse_N_s).is_proved();
    };
    row.stay_error_m = lower.error_m(row.peak_force_N, 0);
    row.thrust_margin_N = thrust(row.peak_force_N, 0).margin_N();
    row.may_stay = nearest_gap_m > 0 && holds(row.peak_force_N, 0);
    if (row.may_stay) {
      result.least_gap_to_stay_m = std::min(result.least_gap_to_stay_m, row.height_gap_m);
    } else {
      const double outside_N =
          largest_allowed(row.peak_force_N, [&](double force_N) { return holds(2 * force_N, 0); });
      const double at_1_m_s = row.peak_force_N * spread_m * field.line_integral();
      constexpr double kSlowest_m_s = 1e-3;
      const double impulse_N_s =
          largest_allowed(at_1_m_s / kSlowest_m_s, [&](double impulse) { return holds(outside_N, impulse); });
      row.keep_out_radius_m = spread_m * field.spreads_at(outside_N / row.peak_force_N);
      const bool may_cross = nearest_gap_m > 0 && impulse_N_s > 0 && outside_N > 0;
      row.least_speed_m_s = may_cross ? at_1_m_s / impulse_N_s : kInfinity;
      if (may_cross) row.thrust_margin_N = thrust(outside_N, impulse_N_s).margin_N();
    }
    if (std::isfinite(row.least_speed_m_s))
      result.least_gap_to_cross_m = std::min(result.least_gap_to_cross_m, row.height_gap_m);
    result.shape.push_back(row);
  }
  return result;
}

}  // namespace swarmcert::stability
