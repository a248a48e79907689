#include "analysis/tracking/tube/truth_force.h"

#include <algorithm>
#include <cmath>

#include "stability/bounds/enclosures/interval_functions.h"
#include "stability/bounds/truth_bounds.h"
#include "stability/effects/registry.h"
#include "stability/effects/wake_shape.h"

namespace swarmcert::analysis {

namespace {

using stability::exp;
using stability::pow;
using stability::square;

/// exp(-7^2/2), rounded up: the strength at which the simulator cuts off wakes.
constexpr double kCutOff = 2.3e-11;
/// Smaller numbers are treated as any number between zero and this, to keep logarithms finite.
constexpr double kTiny = 1e-280;

Interval cut(Interval x, double from, double to) {
  return {std::clamp(x.lower, from, to), std::clamp(x.upper, from, to)};
}

/// x^p for an interval of non-negative numbers.
Interval power(Interval x, double p) {
  return {x.lower > kTiny ? std::max(0.0, pow(Interval(x.lower), p).lower) : 0,
          pow(Interval(std::max(x.upper, kTiny)), p).upper};
}

/// Enclosure of a field and its gradient on a set.
struct Strength {
  Interval g;
  Offset slope;
};

/// (0.3/h)^decay exp(-r^2 / (2 s^2)) u(z), h = max(z, 0.12 m), s = spread + spread_slope h, as in effects/downwash.h.
Strength below_a_vehicle(const Offset& dp, double decay, double spread_m, double spread_slope) {
  Strength result;
  const Interval z = dp[2];
  if (z.upper <= stability::kWakeTouching_m) return result;
  const Interval h = {std::max(z.lower, stability::kWakeNearest_m),
                      std::max(z.upper, stability::kWakeNearest_m)};
  const Interval s = Interval(spread_m) + Interval(spread_slope) * h;
  const Interval ss = square(s);
  const Interval rr = square(dp[0]) + square(dp[1]);
  const Interval profile = exp(-(rr / (Interval(2) * ss)));
  const Interval full = pow(Interval(stability::kWakeReference_m) / h, decay) * profile;
  // u = x^2 (3 - 2 x) rises from 0 at contact of the vehicles to 1 at the smallest gap covered by the fits.
  const Interval range = Interval(stability::kWakeNearest_m) - Interval(stability::kWakeTouching_m);
  const Interval x = cut((z - Interval(stability::kWakeTouching_m)) / range, 0, 1);
  const auto fade = [](double t) {
    return Interval(t) * Interval(t) * (Interval(3) - Interval(2) * Interval(t));
  };
  const Interval u = cut({fade(x.lower).lower, fade(x.upper).upper}, 0, 1);
  result.g = full * u;
  result.g.lower = std::max(0.0, result.g.lower);
  result.slope[0] = -(result.g * dp[0] / ss);
  result.slope[1] = -(result.g * dp[1] / ss);
  // Below 0.12 m only u varies, above it only the remaining factors; a set on both sides may have either slope.
  const Interval rises = full * (Interval(6) * x * (Interval(1) - x) / range);
  const Interval falls = full * (Interval(spread_slope) * rr / (ss * s) - Interval(decay) / h);
  result.slope[2] = z.lower >= stability::kWakeNearest_m   ? falls
                    : z.upper <= stability::kWakeNearest_m ? rises
                                                           : hull(rises, falls);
  return result;
}

/// Cutting off a wake changes the sum by at most its own strength there.
void add_cut_off(double amplitude_N, double decay, TruthForce::Wake& sum) {
  const Interval nearest = Interval(stability::kWakeReference_m) / Interval(stability::kWakeNearest_m);
  const double cut_off_N = up(amplitude_N * kCutOff * pow(nearest, decay).upper * 1.001);
  sum.cut_off_N = up(sum.cut_off_N + cut_off_N);
  sum.value_N += Interval(-cut_off_N, cut_off_N);
}

}  // namespace

TruthForce::TruthForce(const stability::Model& truth, double largest_thrust_N)
    : model_(truth), largest_thrust_N_(largest_thrust_N) {
  for (const stability::EffectSpec& effect : truth.effects) {
    const auto refuse = [&](const std::string& why) {
      if (refusal_.empty()) refusal_ = "the declared truth's effect " + effect.name + " " + why;
    };
    const bool for_some_only = !effect.vehicle.empty();
    if (!effect.is_expression() && effect.name == "downwash") {
      if (effect_value(effect, "tail") != 0 || effect_value(effect, "convection_s_m") != 0) {
        refuse("has a tail or is carried along by the air, for which there is no enclosure over a tube");
      }
      downwash_.push_back({effect_value(effect, "amplitude_N"), effect_value(effect, "decay_exponent"),
                           effect_value(effect, "spread_m"), effect_value(effect, "spread_slope"),
                           effect_value(effect, "norm_exponent"),
                           pow(Interval(truth.mass_kg) / Interval(stability::kWakeReferenceMass_kg),
                               effect_value(effect, "mass_exponent")),
                           for_some_only});
    } else if (!effect.is_expression() && effect.name == "upper_lift") {
      lift_.push_back({effect_value(effect, "amplitude_N"), effect_value(effect, "decay_exponent"),
                       effect_value(effect, "spread_m"), for_some_only});
    } else if (effect.name == "motor_lag") {
      motor_lag_s_ = effect_value(effect, "tau_s");
    } else if (effect.name == "thrust_ratio" || effect.name == "delay") {
      refuse("acts through the loop, which a tube does not model");
    } else {
      stability::MotionSet motion;
      motion.relative_speed_m_s = motion.speed_m_s = motion.acceleration_m_s2 = motion.thrust_rate_N_s = 1;
      motion.largest_height_m = 1;
      motion.largest_thrust_N = largest_thrust_N;
      const stability::EffectBounds bounds = truth_bounds(effect, truth, motion);
      if (!bounds.unbounded.empty()) refuse(": " + bounds.unbounded);
      others_.push_back(effect);
    }
  }
}

void TruthForce::add(const Downwash& field, const std::vector<Offset>& neighbours, Wake& sum) const {
  std::vector<Strength> each;
  Interval total;
  int count = 0;
  for (const Offset& dp : neighbours) {
    each.push_back(below_a_vehicle(dp, field.decay, field.spread_m, field.spread_slope));
    Strength& one = each.back();
    one.g = one.g * field.mass_factor;
    for (Interval& slope : one.slope) slope = slope * field.mass_factor;
    if (one.g.upper <= 0) continue;
    total = ++count == 1 ? one.g : total + one.g;
  }
  if (count == 0) return;
  if (count > 1) {  // (sum g^p)^(1/p), which is increasing in each g
    Interval powers;
    for (const Strength& one : each)
      if (one.g.upper > 0) powers += power(one.g, field.norm);
    total = power({std::max(0.0, powers.lower), powers.upper}, 1 / field.norm);
    // Accounts for the rounding of 1/p: d ln(total) = d(1/p) ln(sum), and |ln| < 700.
    total = total * Interval(1 - 1e-12, 1 + 1e-12);
  }
  const Interval A(field.amplitude_N);
  Interval force = -(A * total);
  if (field.for_some_only) force = hull(force, Interval(0));
  sum.value_N += force;
  const auto wakes = static_cast<double>(neighbours.size());
  add_cut_off(field.amplitude_N * field.mass_factor.upper * wakes, field.decay, sum);
  for (std::size_t j = 0; j < each.size(); ++j) {
    if (each[j].g.upper <= 0) continue;
    // d total / d g_j = (g_j / total)^(p - 1), which lies between 0 and 1.
    Interval share(1);
    if (count > 1) {
      share = {0, 1};
      if (total.lower > kTiny && field.norm > 1) {
        share =
            cut(power(cut(each[j].g / total, 0, 1), field.norm - 1) * Interval(1 - 1e-12, 1 + 1e-12), 0, 1);
      } else if (field.norm == 1) {
        share = 1;
      }
    }
    if (field.for_some_only) share = hull(share, Interval(0));
    for (std::size_t k = 0; k < 3; ++k) sum.gradient_N_m[j][k] += -(A * share * each[j].slope[k]);
  }
}

void TruthForce::add(const Lift& field, const std::vector<Offset>& neighbours, Wake& sum) const {
  for (std::size_t j = 0; j < neighbours.size(); ++j) {
    const Interval z = -neighbours[j][2];
    if (z.upper <= stability::kWakeTouching_m) continue;
    const Interval h = {std::max(z.lower, stability::kWakeNearest_m),
                        std::max(z.upper, stability::kWakeNearest_m)};
    const Interval ss = square(Interval(field.spread_m));
    const Interval rr = square(neighbours[j][0]) + square(neighbours[j][1]);
    Interval force = Interval(field.amplitude_N) *
                     pow(Interval(stability::kWakeReference_m) / h, field.decay) *
                     exp(-(rr / (Interval(2) * ss)));
    const bool may_vanish = z.lower <= stability::kWakeTouching_m || field.for_some_only;
    if (may_vanish) force = hull(force, Interval(0));
    if (z.lower <= stability::kWakeTouching_m && field.amplitude_N > 0) sum.has_gradient = false;
    sum.value_N += force;
    add_cut_off(field.amplitude_N, field.decay, sum);
    Offset& gradient = sum.gradient_N_m[j];
    for (std::size_t k = 0; k < 2; ++k) gradient[k] += -(force * neighbours[j][k] / ss);
    // h equals z beyond 0.12 m, and z = -dp_z: the force increases with dp_z.
    const Interval rise = force * Interval(field.decay) / h;
    gradient[2] += z.lower >= stability::kWakeNearest_m ? rise : hull(rise, Interval(0));
  }
}

TruthForce::Wake TruthForce::wake(const std::vector<Offset>& neighbours) const {
  Wake sum;
  sum.gradient_N_m.resize(neighbours.size());
  for (const Downwash& field : downwash_) add(field, neighbours, sum);
  for (const Lift& field : lift_) add(field, neighbours, sum);
  return sum;
}

std::array<Interval, 3> TruthForce::rest_N(Interval height_m,
                                           const std::array<Interval, 3>& velocity_m_s) const {
  std::array<Interval, 3> force_N;
  stability::MotionSet motion;
  Interval squares;
  for (const Interval& v : velocity_m_s) squares += square(v);
  motion.speed_m_s = sqrt(squares).upper;
  motion.least_height_m = std::max(0.0, height_m.lower);
  motion.largest_height_m = height_m.upper;
  motion.largest_thrust_N = largest_thrust_N_;
  for (const stability::EffectSpec& effect : others_) {
    if (effect.name == "constant_force" && effect.vehicle.empty()) {
      const char* const names[] = {"force_x_N", "force_y_N", "force_z_N"};
      for (std::size_t k = 0; k < 3; ++k) force_N[k] += Interval(effect_value(effect, names[k]));
      continue;
    }
    if (effect.name == "drag_linear" && effect.vehicle.empty()) {
      const Interval drag(effect_value(effect, "drag_N_s_m"));
      for (std::size_t k = 0; k < 3; ++k) force_N[k] += -(drag * velocity_m_s[k]);
      continue;
    }
    const stability::EffectBounds bounds = truth_bounds(effect, model_, motion);
    for (std::size_t k = 0; k < 3; ++k) {
      const double most = up(bounds.amplitude_N[k] + bounds.bias_N[k]);
      force_N[k] += Interval(-most, most);
    }
  }
  return force_N;
}

}  // namespace swarmcert::analysis
