// Curvature of the gains of a sampled loop over a box of ratio r, lag tau and delay T.
//
// Operators act on signals over time; sampling does not commute with shifts. A = x A' e^(-Ts) the actuators, x = 1/(tau
// s + 1), u the command, a = r A u, e'' = a + f. E: force to e; M: force to a; N = 1 + M: force to e''.
//
// Small gain around the centre, as in uncertain_continuous.cpp, with a0 the output of the centre's actuators: the true
// loop is the centre's loop with the additional force d = eps a0 + r dw/dt, eps = r - 1, |w| <= W |a0|. With G the
// amplitude gain (to e or a0) and V the gain from w (the total variation of the kernel), |a0| <= N_a/(1 - lambda),
// lambda = eps G_a + r W V_a, and |e| <= N_e + (eps G_e + r W V_e) |a0|, N the gains from the class; V over the box
// likewise.
// For ramps a0 is unbounded, but n = a0 + f/r is not: d = eps n - (eps/r) f + r dw_n/dt - (a disturbance below W |f'|),
// so |n| <= (N_n/r + G_a W)/(1 - lambda), N_n the gain from f' to a0 + f, and |e| <= N_e/r + (eps G_e + r W V_e) |n| +
// G_e W. For commands, a0 is the response to the command's error divided by r. For short errors, only the part of a0
// that responds to them changes as above, and the error itself passes the lag and the delay only: this change is below
// W sup |kernel(v + h) - kernel(v)|/h at samples.
//
// Second derivatives, from E_r = E M/r, M_r = N M/r, E_tau = -E (s x) M, M_tau = -N (s x) M, (s x)_tau = -(s x)^2, and
// the same with s in place of s x for T (x and s commute with A, but not with E and M):
//   force:   E_rr = 2/r^2 E M M,    (r E)_rr = 2/r E N M,    E_tautau = 2 E (s x) N (s x) M,  E_TT = E s (1 + 2 M) s M;
//   command: E A: the last M is M A in r, 2/r^2 E M (M A), (r E A)_rr = 2/r E M (N A), and N A in tau and T.
// M f and N A c are the accelerations in response to the class; (s x) of them is x times their slope, with |x|_1 = 1,
// |s x|_1 = 2/tau; E s is V_e, N (s x) <= 2/tau + V_a. For ramps only N f = n is bounded: E M M f = E M n - E n + E f,
// E N M f = E M n. For a short command error c: E s s A c is (E s A' c - E s A c)/tau, each below
// sup |kernel(v + h) - kernel(v)|/h. Between samples |e| exceeds the larger of its neighbours by at most
// h^2/8 sup|a + f|.
#include <optional>
#include <utility>
#include <vector>

#include "stability/bounds/loops/kernel_sum.h"
#include "stability/bounds/uncertain/uncertain_part.h"

namespace swarmcert::stability {
namespace {

/// One output of a sampled loop.
struct OutputGains {
  GainNorms force, command;
  double variation = 0;  ///< from w, where the force is dw/dt
  /// First-order effect of delaying a command pulse of one period and area 1, per second.
  double change_of_pulse = 0;
  GainNorms answer;  ///< from commands, excluding their direct feedthrough
};

OutputGains output_gains(const SampledAdjoint& adjoint, const Eigen::RowVectorXd& after, bool with_force,
                         Channel channel) {
  OutputGains gains;
  gains.force = force_gains(adjoint, after, with_force ? 1 : 0);
  const KernelVariation variation = force_variation(adjoint, after);
  gains.variation = variation.total();
  gains.change_of_pulse = variation.most_per_period() / adjoint.period_s();
  if (channel == Channel::kCommand) {
    gains.command = command_gains(adjoint, after);
    gains.answer = command_gains(adjoint, after, false);
  }
  return gains;
}

GainNorms larger_of(GainNorms a, const GainNorms& b) {
  for (const auto gain : kUncertainGains) a.*gain = std::max(a.*gain, b.*gain);
  return a;
}

double toward(double near, double far, double share) { return near + share * std::max(0.0, far - near); }

/// The output of the actuators.
struct Actuators {
  OutputGains a;                          ///< a0 at all times
  GainNorms slope;                        ///< of a0, from the channel's classes
  double slope_by_amplitude = kInfinity;  ///< of a0, per force
};

/// Bounds a0 at all times: within a period it is a convex combination of its value at the sample, with weight at least
/// 1 - share, the other lags' outputs and the commands. Its slope is (input - a0)/tau; the difference moves from its
/// value at the sample towards the slope of the input, a difference of the previous lag or of commands. After a new
/// command it is a convex combination of its differences from that command.
Actuators actuator_gains(const SampledLoop& loop, const SampledAdjoint& adjoint, Channel channel) {
  using Row = Eigen::RowVectorXd;
  const SampledModel& model = adjoint.model();
  const Eigen::Index lags = model.integral_index() - 2;
  const auto row = [&](Eigen::Index i) { return Row(Row::Unit(model.size() + 1, i)); };
  Actuators result;
  const OutputGains commanded = output_gains(adjoint, row(model.command_index()), true, channel);
  result.a = commanded;
  result.slope = {kInfinity, kInfinity, kInfinity, kInfinity};
  if (lags == 0) return result;
  OutputGains far = commanded;
  for (Eigen::Index i = 1; i < lags; ++i) {
    const OutputGains other = output_gains(adjoint, row(2 + i), true, channel);
    far.force = larger_of(far.force, other.force);
    far.command = larger_of(far.command, other.command);
    far.variation = std::max(far.variation, other.variation);
  }
  std::vector<double> lags_s;
  for (const double tau : loop.plant.lags_s) {
    if (tau > 0) lags_s.push_back(tau);
  }
  const double share = -std::expm1(-loop.period_s / lags_s[0]);
  OutputGains near = output_gains(adjoint, row(2), true, channel);
  for (const auto gain : kUncertainGains) {
    near.force.*gain = toward(near.force.*gain, far.force.*gain, share);
    near.command.*gain = toward(near.command.*gain, far.command.*gain, share);
  }
  near.variation = toward(near.variation, far.variation, share);
  near.answer = commanded.answer;
  near.change_of_pulse = commanded.change_of_pulse;
  result.a = near;

  // From the first lag, which the commands drive, to the last: gains to the lag's input minus its output.
  const auto gains_of = [&](const Row& after) {
    const OutputGains gains = output_gains(adjoint, after, false, channel);
    return std::pair(channel == Channel::kForce ? gains.force : gains.command, gains.force.amplitude);
  };
  const auto newest = static_cast<Eigen::Index>(std::floor(loop.plant.delay_s / loop.period_s + 1e-9));
  const Row now = row(model.command_index() + newest);
  auto [difference, by_amplitude] = gains_of(now - row(1 + lags));
  if (model.command_index() + newest < model.size()) {
    const Row before = row(model.command_index() + newest + 1);
    for (const Row& other : {Row(before - row(1 + lags)), Row(now - before)}) {
      const auto [gains, amplitude] = gains_of(other);
      difference = larger_of(difference, gains);
      by_amplitude = std::max(by_amplitude, amplitude);
    }
  }
  for (Eigen::Index i = lags - 1; i-- > 0;) {
    const double before_s = lags_s[static_cast<std::size_t>(i) + 1];
    const auto [gains, amplitude] = gains_of(row(3 + i) - row(2 + i));
    for (const auto gain : kUncertainGains) {
      difference.*gain = gains.*gain + loop.period_s / before_s * (difference.*gain);
    }
    by_amplitude = amplitude + loop.period_s / before_s * by_amplitude;
  }
  for (const auto gain : kUncertainGains) result.slope.*gain = difference.*gain / lags_s[0];
  result.slope_by_amplitude = by_amplitude / lags_s[0];
  return result;
}

/// Bounds over a box around a centre, per 1 kg, from the small-gain argument and the centre's values.
struct OverBox {
  double ge = 0, ga = 0;            ///< amplitude gains to e and a
  double ve = 0, va = 0;            ///< the same from w
  double pulse_e = 0, pulse_a = 0;  ///< OutputGains::change_of_pulse
  FourGains first_order{};          ///< of e
  FourGains answer{};               ///< M f, or M A c
  FourGains total{};                ///< N A c, commands only
  FourGains slope{};                ///< of M f, or of N A c
  double of_ramp = 0;               ///< N f for ramps, or N A c
};

/// The centre's gains at all times, and the constants of the small-gain argument over the box.
struct BoxTerms {
  Actuators actuators;
  OutputGains e;
  double bend = 0;           ///< h^2/8: factor of the second derivative between samples
  double n_rate = 0;         ///< N f for ramps
  double further = 0;        ///< of e, per sup of a0
  double lambda = 0;         ///< of a0, per sup of a0
  double through = 0;        ///< of a, per a0
  double inverse_ratio = 0;  ///< largest, times the centre's
  double lag_and_delay_s = 0;
  double delay_s = 0;                 ///< largest change
  double slope_left = 0, of_sup = 0;  ///< slopes of a0, through which the delay acts
  bool has_slope = false;
};

/// Includes e between samples: a force of total variation 1 from rest stays below 1, and f changes by less than |f'|
/// (T0 + 2 h) until it acts.
void add_bend(bool is_force, const SampledLoop& loop, BoxTerms& terms) {
  const double h = loop.period_s;
  const OutputGains& a = terms.actuators.a;
  OutputGains& e = terms.e;
  terms.bend = h * h / 8;
  terms.n_rate = is_force ? a.force.rate + loop.plant.delay_s + 2 * h : a.command.rate;
  e.force.rate += terms.bend * terms.n_rate;
  e.force.amplitude += terms.bend * (1 + a.force.amplitude);
  e.force.edge += terms.bend * (1 + a.force.amplitude);
  e.force.impulse += terms.bend * a.force.impulse;
  e.variation += terms.bend * a.variation + h / 2;
  for (const auto gain : kUncertainGains) e.command.*gain += terms.bend * a.command.*gain;
}

/// Handles classes of the force. Also sets the excess of errors between samples.
void add_force_gains(const BoxTerms& t, OverBox& over, PlantBends& bends) {
  const OutputGains& a = t.actuators.a;
  for (std::size_t k = 1; k < 4; ++k) {
    const double a0 = a.force.*kUncertainGains[k] / (1 - t.lambda);
    over.first_order[k] = t.e.force.*kUncertainGains[k] + t.further * a0;
    over.answer[k] = t.through * a0;
    if (t.has_slope)
      over.slope[k] = t.through * (t.actuators.slope.*kUncertainGains[k] + t.of_sup * a0) / t.slope_left;
    bends.between_samples[k] = t.bend * ((k < 3 ? 1 : 0) + over.answer[k]);
  }
  const double n = (t.inverse_ratio * t.n_rate + a.force.amplitude * t.lag_and_delay_s) / (1 - t.lambda);
  over.first_order[0] =
      t.inverse_ratio * t.e.force.rate + t.further * n + t.e.force.amplitude * t.lag_and_delay_s;
  over.answer[0] = kInfinity;
  over.of_ramp = t.through * n + t.lag_and_delay_s;
  if (t.has_slope) {
    over.slope[0] = t.through *
                    (t.inverse_ratio * t.actuators.slope.rate + t.of_sup * n +
                     t.actuators.slope_by_amplitude * (t.delay_s + t.lag_and_delay_s)) /
                    t.slope_left;
  }
  bends.between_samples[0] = t.bend * over.of_ramp;
}

/// Handles classes of the command.
void add_command_gains(const BoxTerms& t, OverBox& over, PlantBends& bends) {
  const OutputGains& a = t.actuators.a;
  for (std::size_t k = 0; k < 4; ++k) {
    const double a0 = t.inverse_ratio * a.command.*kUncertainGains[k] / (1 - t.lambda);
    over.first_order[k] = t.inverse_ratio * t.e.command.*kUncertainGains[k] + t.further * a0;
    over.total[k] = t.through * a0;
    over.answer[k] = k == 0 ? kInfinity : over.total[k] + 1;
    if (t.has_slope) {
      over.slope[k] = t.through * (t.inverse_ratio * t.actuators.slope.*kUncertainGains[k] + t.of_sup * a0) /
                      t.slope_left;
    }
    bends.between_samples[k] = t.bend * over.total[k];
  }
  const double answer = (a.answer.impulse + t.lag_and_delay_s * a.change_of_pulse) / (1 - t.lambda);
  over.answer[3] = t.through * answer;
  over.first_order[3] = std::min(
      over.first_order[3], t.e.command.impulse + t.further * answer +
                               t.lag_and_delay_s * (t.e.change_of_pulse + t.bend * a.change_of_pulse + 0.5));
  over.of_ramp = over.total[0];
}

/// Returns nothing if the small-gain argument gives no bound. Sets the shares of `bends`, and the excess of errors
/// between samples.
std::optional<OverBox> over_box(const SampledLoop& loop, Channel channel, const PlantBox& box,
                                PlantBends& bends) {
  bends.share = {box.ratio_change(), loop.plant.Kd * box.lag_change(), loop.plant.Kd * box.delay_change()};
  const SampledAdjoint adjoint(loop);
  if (!adjoint.is_stable()) return std::nullopt;
  const bool is_force = channel == Channel::kForce;
  BoxTerms terms;
  terms.actuators = actuator_gains(loop, adjoint, channel);
  terms.e = output_gains(adjoint, adjoint.output_after_control(0), false, channel);
  add_bend(is_force, loop, terms);
  const OutputGains& a = terms.actuators.a;
  const OutputGains& e = terms.e;

  const double r = box.largest_ratio();
  const double eps = box.ratio_change();
  const double G_a = a.force.amplitude;
  const double G_e = e.force.amplitude;
  // Effect of the additional force on a0 and e, per sup of a0.
  const auto of_lag = [&](double G, double V) {
    return r * std::min(times(box.lag_change(), V), times(box.lag_ratio(), G));
  };
  const auto of_delay = [&](double V) { return r * box.delay_change() * V; };
  bends.share = {eps * G_a, of_lag(G_a, a.variation), of_delay(a.variation)};
  terms.lambda = bends.share[0] + bends.share[1] + bends.share[2];
  if (!(terms.lambda < 1)) return std::nullopt;
  terms.further = eps * G_e + of_lag(G_e, e.variation) + of_delay(e.variation);
  terms.inverse_ratio = box.centre()[0] / box.from[0];
  terms.delay_s = box.delay_change();
  terms.lag_and_delay_s = box.lag_change() + box.delay_change();
  terms.through = r * (1 + box.lag_ratio());
  terms.slope_left = 1 - times(r * box.delay_change(), terms.actuators.slope_by_amplitude);
  terms.of_sup = terms.actuators.slope_by_amplitude * (eps + times(r, box.lag_ratio()));
  terms.has_slope = terms.slope_left > 0 && std::isfinite(terms.of_sup);

  OverBox over;
  over.ge = G_e + terms.further * G_a / (1 - terms.lambda);
  over.ga = terms.through * G_a / (1 - terms.lambda);
  over.ve = e.variation + terms.further * a.variation / (1 - terms.lambda);
  over.va = terms.through * a.variation / (1 - terms.lambda);
  over.pulse_e = e.change_of_pulse + terms.further * a.change_of_pulse / (1 - terms.lambda);
  over.pulse_a = terms.through * a.change_of_pulse / (1 - terms.lambda);
  over.slope.fill(kInfinity);
  if (is_force)
    add_force_gains(terms, over, bends);
  else
    add_command_gains(terms, over, bends);
  return over;
}

}  // namespace

PlantBends bends_over(const SampledLoop& fixed, Channel channel, const PlantBox& box) {
  SampledLoop loop = fixed;
  loop.plant = plant_at(fixed.plant, box.centre());
  PlantBends bends;
  const std::optional<OverBox> over = over_box(loop, channel, box, bends);
  if (!over) return bends;
  const auto& [ge, ga, ve, va, pulse_e, pulse_a, first_order, answer, total, slope, n] = *over;
  bends.first_order = first_order;
  if (!(loop.plant.Ki > 0)) bends.first_order[0] = kInfinity;
  const bool is_force = channel == Channel::kForce;
  const bool at_least_mass = box.edge == PlantEdge::kLeastMass;
  const double sx = box.from[1] > 0 ? 2 / box.from[1] : kInfinity;
  const double e_sx = std::min(ve, sx * ge);
  // On the edge of least thrust, bends refer to the gain times the ratio.
  const double by = at_least_mass ? 1 : box.to[0];
  for (std::size_t k = 0; k < 4; ++k) {
    const double z = answer[k];
    const double q = is_force ? z : total[k];
    double in_ratio;
    if (at_least_mass) {
      in_ratio = std::min(
          ge * ga * z, k == 0 || !is_force ? ge * (1 + ga) * (is_force ? n : q) + first_order[k] : kInfinity);
    } else if (is_force) {
      in_ratio = k == 0 ? ge * ga * n : ge * (1 + ga) * z;
    } else {
      in_ratio = std::min(ge * ga * q, ge * (1 + ga) * z);
    }
    const double lo = box.from[0];
    bends.absolute[k][0] =
        times(box.width(0) * box.width(0) / 8, 2 * in_ratio / (at_least_mass ? lo * lo : lo));

    const double through_lag = std::min({(sx + va) * q, (1 + ga) * slope[k], (1 + ga) * sx * q});
    double in_lag = 2 * e_sx * through_lag;
    double first_in_lag = std::min({ve * q, ge * slope[k], ge * sx * q});
    double in_delay = ve * (1 + 2 * ga) * slope[k];
    double first_in_delay = std::min(ve * q, ge * slope[k]);
    if (!is_force && k == 3) {
      in_lag = std::min(in_lag, 2 * (sx * (pulse_e + ve * z) + ve * (pulse_a + va * z)));
      in_delay = std::min(in_delay, sx * (pulse_e + ve * z) + 2 * ve * (pulse_a + va * z));
      first_in_lag = std::min(first_in_lag, pulse_e + ve * z);
      first_in_delay = std::min(first_in_delay, pulse_e + ve * z);
    }
    const auto missed = [by](double width, double second, double first) {
      return by * std::min(times(width * width / 8, second), times(width / 2, first));
    };
    bends.absolute[k][1] = missed(box.width(1), in_lag, first_in_lag);
    bends.absolute[k][2] = missed(box.width(2), in_delay, first_in_delay);
  }
  return bends;
}

}  // namespace swarmcert::stability
