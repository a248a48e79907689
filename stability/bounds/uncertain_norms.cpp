// Small gain around the centre of a part. Accelerations throughout: a is what the actuators give, f the force over the
// true mass, e'' = a + f. With r the ratio of thrust/mass to the centre's, lag and delay (tau, T) and (tau0, T0):
//   a = r (1 + Delta_L)(1 + Delta_D) a0,  a0 what the centre's actuators would give for the same commands,
//   Delta_L = (tau0 - tau) s/(tau s + 1),  Delta_D = e^(-(T - T0)s) - 1.
// Both are a derivative of something small: Delta_L Delta_D-wise a - r a0 = r dw/dt with
// |w|_oo <= W |a0|_oo, W = |tau - tau0| + |T - T0|. Besides, |Delta_L|_1 <= 2 |tau - tau0|/tau.
// So the true loop is the centre's under the further force d = eps a0 + r dw/dt, eps = r - 1.
//
// Continuous loop: everything commutes, so every gain is at most the centre's over 1 - |Delta T|_1, T the loop from a
// force to a0, times |1 + Delta_L|_1 where the disturbance passes the actuators.
//
// Sampled loop, from forces: with G the amplitude gain (to e or a0) and V the gain from w (the total variation of the
// kernel), |a0| <= N_a/(1 - lambda), lambda = eps G_a + r W V_a, and |e| <= N_e + (eps G_e + r W V_e) |a0|, N of the
// class. For ramps a0 is unbounded; but n = a0 + f/r is not: d = eps n - (eps/r) f + r dw_n/dt - (a disturbance below
// W |f'|), so |n| <= (N_n/r + G_a W)/(1 - lambda), N_n the gain from f' to a0 + f, and
// |e| <= N_e/r + (eps G_e + r W V_e) |n| + G_e W. From commands: a0 answers the command's error over r; or, for short
// errors, the part of a0 that answers them is changed as above, the error itself passes the lag and the delay only:
// what that changes is below W sup |kernel(v + h) - kernel(v)|/h at samples, and W/2 more between them.
// Between samples |e| exceeds the larger of its neighbours by at most h^2/8 sup|a0 + f| (and h/2 sup|w| for d).
#include "stability/bounds/uncertain_norms.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "nn/files/doubles.h"
#include "stability/bounds/kernel_sum.h"

namespace swarmcert::stability {
namespace {

constexpr std::array<double GainNorms::*, 4> kGains = {&GainNorms::rate, &GainNorms::amplitude,
                                                       &GainNorms::edge, &GainNorms::impulse};

/// Thrust per mass relative to what the controller was told, lag, delay.
using Point = std::array<double, 3>;

struct Part {
  Point from{}, to{};
  std::array<double, 4> upper{};  ///< of each gain, m per unit of force
  std::array<double, 3> share{};  ///< what each dimension adds to the bounds

  Point centre() const { return {(from[0] + to[0]) / 2, (from[1] + to[1]) / 2, (from[2] + to[2]) / 2}; }
  double ratio_change() const { return (to[0] - from[0]) / (to[0] + from[0]); }  ///< relative
  double lag_change() const { return (to[1] - from[1]) / 2; }
  double delay_change() const { return (to[2] - from[2]) / 2; }
  /// Bound of |Delta_L|_1.
  double lag_ratio() const {
    const double change = lag_change();
    return change == 0 ? 0 : from[1] > 0 ? 2 * change / from[1] : kInfinity;
  }
};

/// x times a gain that may be infinite: nothing where x is nothing.
double scaled(double x, double gain) { return x == 0 ? 0 : x * gain; }

AxisLoop plant_at(AxisLoop loop, const Point& p) {
  loop.mass_kg = 1;
  loop.Kp *= p[0];
  loop.Kd *= p[0];
  loop.Ki *= p[0];
  loop.lags_s.insert(loop.lags_s.begin(), p[1]);
  loop.delay_s = p[2];
  return loop;
}

/// Gains for 1 kg at a point, and their upper bounds over a part around its centre.
struct Family {
  std::function<GainNorms(const Point&)> at;
  std::function<void(Part&, const GainNorms& at_centre)> bound;
};

void bound_continuous(const AxisLoop& fixed, Channel channel, Part& part, const GainNorms& norms) {
  const AxisLoop loop = plant_at(fixed, part.centre());
  part.upper.fill(kInfinity);
  part.share = {part.ratio_change(), std::min(part.lag_ratio(), 4 * loop.Kd * part.lag_change()),
                loop.Kd * part.delay_change()};
  if (!std::isfinite(norms.amplitude)) return;
  // T = (Kd s^2 + Kp s + Ki)/D(s), but for its delay.
  TransferFunction T = step_transfer(loop, Channel::kCommand);
  T.numerator = {loop.Ki, loop.Kp, loop.Kd};
  if (loop.Ki == 0) {
    T = impulse_transfer(loop, Channel::kCommand);
    T.numerator = {loop.Kp, loop.Kd};
  }
  const ResponseNorms response = response_norms(T);
  const bool has_lag = T.denominator.size() > (loop.Ki > 0 ? 4 : 3);
  const double variation = response.variation + (has_lag ? 0 : loop.Kd);  // |T s|_1
  const double r = part.to[0] / part.centre()[0];
  const double by_ratio = part.ratio_change() * response.integral_abs;
  const double by_lag =
      r * std::min(scaled(part.lag_change(), variation), part.lag_ratio() * response.integral_abs);
  const double by_delay = r * part.delay_change() * variation;
  part.share = {by_ratio, by_lag, by_delay};
  const double loop_gain = by_ratio + by_lag + by_delay;
  if (!(loop_gain < 1)) return;
  GainNorms entering = norms;
  if (channel == Channel::kCommand && part.lag_change() > 0) {
    // 1 + Delta_L acts on the disturbance: in the sup norm, or through the response's derivative.
    const double change = part.lag_change();
    GainNorms slope = {norms.amplitude, kInfinity, norms.impulse, kInfinity};
    if (loop.Ki > 0) slope.amplitude = response_norms(step_transfer(loop, channel)).curvature_integral;
    slope.impulse = response_norms(impulse_transfer(loop, channel)).slope_max_abs;
    for (const auto gain : kGains) {
      entering.*gain = norms.*gain + std::min(change * slope.*gain, part.lag_ratio() * norms.*gain);
    }
  }
  for (std::size_t k = 0; k < 4; ++k) part.upper[k] = entering.*kGains[k] / (1 - loop_gain);
}

/// One output of a sampled loop.
struct OutputGains {
  GainNorms force, command;
  double variation = 0;  ///< from w, where the force is dw/dt
  double change_of_pulse =
      0;  ///< from a command of one period and area 1 that comes a second later, to first order
  double pulse_answer = 0;  ///< from such a command, its own passing through not counted
};

OutputGains output_gains(const SampledAdjoint& adjoint, const Eigen::RowVectorXd& after, bool with_force,
                         Channel channel) {
  OutputGains gains;
  struct {
    KernelSum gains;
    KernelVariation variation;
    void add_linear(double start, double slope, double length) {
      gains.add_linear(start, slope, length);
      variation.add_linear(start, slope, length);
    }
    void add_series(double start, double slope, double length, double ratio) {
      gains.add_series(start, slope, length, ratio);
      variation.add_series(start, slope, length, ratio);
    }
  } sum{KernelSum(with_force ? 1 : 0), {}};
  add_force_kernel(adjoint, after, sum);
  gains.force = sum.gains.norms();
  gains.variation = sum.variation.total();
  if (channel == Channel::kCommand) {
    gains.command = command_gains(adjoint, after);
    gains.change_of_pulse = sum.variation.most_per_period() / adjoint.period_s();
    gains.pulse_answer = command_gains(adjoint, after, false).impulse;
  }
  return gains;
}

double toward(double near, double far, double share) { return near + share * std::max(0.0, far - near); }

/// Of a0 at all times: on a period it is a convex combination of its value at the sample, of which at least
/// 1 - share, with the other lags' outputs and the commands. pulse_answer and change_of_pulse are those of the command.
OutputGains actuator_gains(const SampledLoop& loop, const SampledAdjoint& adjoint, Channel channel) {
  const SampledModel& model = adjoint.model();
  const auto row = [&](Eigen::Index i) { return Eigen::RowVectorXd::Unit(model.size() + 1, i); };
  const OutputGains commanded = output_gains(adjoint, row(model.command_index()), true, channel);
  OutputGains far = commanded;
  const Eigen::Index lags = model.integral_index() - 2;
  if (lags == 0) return far;
  const auto raise = [](GainNorms& to, const GainNorms& by) {
    for (const auto gain : kGains) to.*gain = std::max(to.*gain, by.*gain);
  };
  for (Eigen::Index i = 1; i < lags; ++i) {
    const OutputGains other = output_gains(adjoint, row(2 + i), true, channel);
    raise(far.force, other.force);
    raise(far.command, other.command);
    far.variation = std::max(far.variation, other.variation);
  }
  double last_lag_s = 0;
  for (const double tau : loop.plant.lags_s) {
    if (tau > 0 && last_lag_s == 0) last_lag_s = tau;
  }
  const double share = -std::expm1(-loop.period_s / last_lag_s);
  OutputGains near = output_gains(adjoint, row(2), true, channel);
  for (const auto gain : kGains) {
    near.force.*gain = toward(near.force.*gain, far.force.*gain, share);
    near.command.*gain = toward(near.command.*gain, far.command.*gain, share);
  }
  near.variation = toward(near.variation, far.variation, share);
  near.pulse_answer = commanded.pulse_answer;
  near.change_of_pulse = commanded.change_of_pulse;
  return near;
}

void bound_sampled(const SampledLoop& fixed, Channel channel, Part& part) {
  SampledLoop loop = fixed;
  loop.plant = plant_at(fixed.plant, part.centre());
  const double h = loop.period_s;
  part.upper.fill(kInfinity);
  part.share = {part.ratio_change(), loop.plant.Kd * part.lag_change(), loop.plant.Kd * part.delay_change()};
  const SampledAdjoint adjoint(loop);
  if (!adjoint.is_stable()) return;
  const bool integrates = loop.plant.Ki > 0;
  const OutputGains a = actuator_gains(loop, adjoint, channel);
  OutputGains e = output_gains(adjoint, adjoint.output_after_control(0), false, channel);
  // Between samples; a force of variation 1 from rest stays below 1, and f moves less than |f'| (T0 + 2 h) until it acts.
  const double bend = h * h / 8;
  const double n_rate = a.force.rate + loop.plant.delay_s + 2 * h;
  e.force.rate += bend * n_rate;
  e.force.amplitude += bend * (1 + a.force.amplitude);
  e.force.edge += bend * (1 + a.force.amplitude);
  e.force.impulse += bend * a.force.impulse;
  e.variation += bend * a.variation + h / 2;
  for (const auto gain : kGains) e.command.*gain += bend * a.command.*gain;

  const double r = part.to[0] / part.centre()[0];
  const double eps = part.ratio_change();
  const double G_a = a.force.amplitude;
  const double G_e = e.force.amplitude;
  // What the further force does to a0 and to e, per sup of a0.
  const auto of_lag = [&](double G, double V) {
    return r * std::min(scaled(part.lag_change(), V), scaled(part.lag_ratio(), G));
  };
  const auto of_delay = [&](double V) { return r * part.delay_change() * V; };
  part.share = {eps * G_e, of_lag(G_e, e.variation), of_delay(e.variation)};
  const double lambda = eps * G_a + of_lag(G_a, a.variation) + of_delay(a.variation);
  if (!(lambda < 1)) return;
  const double further = part.share[0] + part.share[1] + part.share[2];
  const double inverse_ratio = part.centre()[0] / part.from[0];
  const double W = part.lag_change() + part.delay_change();
  if (channel == Channel::kCommand) {
    for (std::size_t k = 0; k < 4; ++k) {
      part.upper[k] = inverse_ratio * (e.command.*kGains[k] + further * a.command.*kGains[k] / (1 - lambda));
    }
    const double answer = (a.pulse_answer + W * a.change_of_pulse) / (1 - lambda);
    part.upper[3] = std::min(part.upper[3], e.command.impulse + further * answer +
                                                W * (e.change_of_pulse + bend * a.change_of_pulse + 0.5));
  } else {
    for (std::size_t k = 1; k < 4; ++k) {
      part.upper[k] = e.force.*kGains[k] + further * a.force.*kGains[k] / (1 - lambda);
    }
    const double n = (inverse_ratio * n_rate + G_a * W) / (1 - lambda);
    part.upper[0] = inverse_ratio * e.force.rate + further * n + G_e * W;
  }
  if (!integrates) part.upper[0] = kInfinity;
}

UncertainNorms subdivide(const Family& family, double told_mass_kg, const UncertainPlant& plant,
                         double relative_gap, int most_evaluations) {
  UncertainNorms result;
  const std::array<UncertainGain*, 4> gains = {&result.rate, &result.amplitude, &result.edge,
                                               &result.impulse};
  // Gains are per mass: of those with a ratio, the lightest vehicle counts.
  const auto lightest_kg = [&](double ratio) {
    return std::max(plant.mass_kg.from, plant.thrust_scale.from * told_mass_kg / ratio);
  };
  const auto evaluate = [&](const Point& p) {
    const GainNorms norms = family.at(p);
    const double mass_kg = std::min(lightest_kg(p[0]), plant.mass_kg.to);
    for (std::size_t k = 0; k < 4; ++k) {
      const double value = norms.*kGains[k] / mass_kg;
      if (value > gains[k]->lower) {
        *gains[k] = {value, gains[k]->upper, mass_kg, p[0] * mass_kg / told_mass_kg, p[1], p[2]};
      }
    }
    ++result.evaluations;
    return norms;
  };
  const auto bound = [&](Part& part) {
    family.bound(part, evaluate(part.centre()));
    for (double& upper : part.upper) upper /= lightest_kg(part.to[0]);
  };
  Part whole;
  whole.from = {plant.thrust_scale.from * told_mass_kg / plant.mass_kg.to, plant.lag_s.from,
                plant.delay_s.from};
  whole.to = {plant.thrust_scale.to * told_mass_kg / plant.mass_kg.from, plant.lag_s.to, plant.delay_s.to};
  for (int corner = 0; corner < 8; ++corner) {
    Point p;
    for (std::size_t i = 0; i < 3; ++i) p[i] = (corner >> i) % 2 == 0 ? whole.from[i] : whole.to[i];
    evaluate(p);
  }
  bound(whole);
  std::vector<Part> parts = {whole};
  while (true) {
    // The part and gain that are farthest from what was reached.
    std::size_t worst = 0;
    double worst_ratio = 0;
    for (std::size_t k = 0; k < 4; ++k) gains[k]->upper = gains[k]->lower;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      for (std::size_t k = 0; k < 4; ++k) {
        gains[k]->upper = std::max(gains[k]->upper, parts[i].upper[k]);
        if (std::isinf(gains[k]->lower)) continue;  // nothing to prove: it is infinite
        const double ratio = parts[i].upper[k] / gains[k]->lower;
        if (ratio > worst_ratio) worst_ratio = ratio, worst = i;
      }
    }
    if (worst_ratio <= 1 + relative_gap || result.evaluations >= most_evaluations) break;
    // Halve what adds most.
    const auto& share = parts[worst].share;
    const auto most = static_cast<std::size_t>(std::max_element(share.begin(), share.end()) - share.begin());
    Part high = parts[worst];
    parts[worst].to[most] = high.from[most] = (high.from[most] + high.to[most]) / 2;
    bound(parts[worst]);
    bound(high);
    parts.push_back(high);
  }
  return result;
}

}  // namespace

UncertainNorms uncertain_norms(const AxisLoop& loop, const UncertainPlant& plant, Channel channel,
                               double relative_gap, int most_evaluations) {
  return subdivide(
      {[&](const Point& p) { return continuous_norms(plant_at(loop, p), channel); },
       [&](Part& part, const GainNorms& norms) { bound_continuous(loop, channel, part, norms); }},
      loop.mass_kg, plant, relative_gap, most_evaluations);
}

UncertainNorms uncertain_norms(const SampledLoop& loop, const UncertainPlant& plant, Channel channel,
                               double relative_gap, int most_evaluations) {
  const auto at = [&](const Point& p) {
    SampledLoop here = loop;
    here.plant = plant_at(loop.plant, p);
    return sampled_norms(here, channel, Instants::kSampling);
  };
  return subdivide({at, [&](Part& part, const GainNorms&) { bound_sampled(loop, channel, part); }},
                   loop.plant.mass_kg, plant, relative_gap, most_evaluations);
}

}  // namespace swarmcert::stability
