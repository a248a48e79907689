// Curvature of the gains of a continuous loop over a box of ratio r, lag tau and delay T.
//
// Small gain around the centre. All signals are accelerations: a is the output of the actuators, f the force divided by
// the true mass, e'' = a + f. Let r be relative to the centre's ratio, (tau, T) lag and delay, and (tau0, T0) those of
// the centre:
//   a = r (1 + Delta_L)(1 + Delta_D) a0,  with a0 the output of the centre's actuators for the same commands,
//   Delta_L = (tau0 - tau) s/(tau s + 1),  Delta_D = e^(-(T - T0)s) - 1.
// Both are derivatives of something small: a - r a0 = r dw/dt with
// |w|_oo <= W |a0|_oo, W = |tau - tau0| + |T - T0|. Furthermore, |Delta_L|_1 <= 2 |tau - tau0|/tau.
// Hence the true loop is the centre's loop with the additional force d = (r - 1) a0 + r dw/dt. All operators commute.
// Let M be the complementary response of the centre (from a force to -a0) and lambda the norm of the map from the
// centre's force to d. Then every gain is at most the centre's gain divided by 1 - lambda, times |1 + Delta_L|_1 if the
// disturbance passes the actuators. The same holds for M and for its derivative, with r (1 + Delta_L) in front.
//
// Second derivatives. D = L s^3 + r F e^(-Ts), F = Kd s^2 + Kp s + Ki, M = r F e^(-Ts)/D, S = 1 - M, x = 1/(tau s + 1)
// the motors' part of L, y = L/D (force) or 1/D (command, whose own delay does not affect norms):
//   y_rr = 2/r^2 M^2 y,  (r y)_rr = -2/r^2 M S (r y),
//   force:   y_tau = M (s x) y,   y_tautau = -2 (s x)^2 M S y;
//   command: y_tau = -(s x) S y,  y_tautau = 2 (s x)^2 S^2 y,
//   y_T = s M y,  y_TT = -s^2 M (1 - 2 M) y,
// where |s x|_1 = 2/tau, |x|_1 = 1, and derivatives may be applied to y instead: |s y| is again a gain.
#include "stability/bounds/uncertain/uncertain_part.h"

namespace swarmcert::stability {
namespace {

/// Returns the interpolation error between two points, from a bound on the second derivative or on the first.
double missed_between(double width, double second, double first) {
  return std::min(times(width * width / 8, second), times(width / 2, first));
}

/// Returns M without its delay, which does not affect norms.
TransferFunction complementary_of(const AxisLoop& loop) {
  TransferFunction complementary = step_transfer(loop, Channel::kCommand);
  complementary.numerator = {loop.Ki, loop.Kp, loop.Kd};
  if (loop.Ki == 0) {
    complementary = impulse_transfer(loop, Channel::kCommand);
    complementary.numerator = {loop.Kp, loop.Kd};
  }
  return complementary;
}

/// Sets the bend of gain `k` over coordinate `j`: the relative one, or the absolute one if that is smaller.
void keep_smaller(PlantBends& bends, std::size_t k, std::size_t j, double relative, double absolute,
                  double at_centre) {
  const bool is_absolute = absolute < relative * at_centre;
  (is_absolute ? bends.absolute : bends.relative)[k][j] = is_absolute ? absolute : relative;
}

}  // namespace

PlantBends bends_over(const AxisLoop& fixed, Channel channel, const PlantBox& box) {
  const AxisLoop loop = plant_at(fixed, box.centre());
  PlantBends bends;
  bends.share = {box.ratio_change(), std::min(box.lag_ratio(), 4 * loop.Kd * box.lag_change()),
                 loop.Kd * box.delay_change()};
  const GainNorms norms = continuous_norms(loop, channel);
  if (!std::isfinite(norms.amplitude)) return bends;
  const TransferFunction complementary = complementary_of(loop);
  const ResponseNorms response = response_norms(complementary);
  const bool has_lag = complementary.denominator.size() > (loop.Ki > 0 ? 4 : 3);
  const double variation = response.variation + (has_lag ? 0 : loop.Kd);  // |s M|_1
  const double r = box.largest_ratio();
  bends.share = {
      box.ratio_change() * response.integral_abs,
      r * std::min(times(box.lag_change(), variation), times(box.lag_ratio(), response.integral_abs)),
      r * box.delay_change() * variation};
  const double lambda = bends.share[0] + bends.share[1] + bends.share[2];
  if (!(lambda < 1)) return bends;
  // Gains of s y. The error after an impulse starts at zero with a nonzero slope.
  const ResponseNorms impulse = response_norms(impulse_transfer(loop, channel));
  const FourGains slope = {norms.amplitude, impulse.variation, norms.impulse, impulse.slope_max_abs};
  FourGains slope_over{};
  for (std::size_t k = 0; k < 4; ++k) {
    double entering = norms.*kUncertainGains[k];
    if (channel == Channel::kCommand) {
      entering += std::min(times(box.lag_change(), slope[k]), times(box.lag_ratio(), entering));
    }
    bends.first_order[k] = entering / (1 - lambda);
    slope_over[k] = slope[k] * (channel == Channel::kCommand ? 1 + box.lag_ratio() : 1) / (1 - lambda);
  }
  const double M = (response.integral_abs + lambda) / (1 - lambda);
  const double sM = variation * r * (1 + box.lag_ratio()) / (1 - lambda);
  const double S = 1 + M;
  const double sx = box.from[1] > 0 ? 2 / box.from[1] : kInfinity;
  const double sxM = std::min(sM, sx * M);
  const double sxS = std::min(sx + sxM, sx * S);
  const double by_ratio = box.width(0) * box.width(0) / (4 * box.from[0] * box.from[0]) * M *
                          (box.edge == PlantEdge::kLeastMass ? M : S);
  for (std::size_t k = 0; k < 4; ++k) {
    bends.relative[k][0] = by_ratio;
    const double at_centre = norms.*kUncertainGains[k];
    const double sy = slope_over[k];
    const bool is_force = channel == Channel::kForce;
    const double lag_relative = is_force ? missed_between(box.width(1), 2 * sxM * sxS, sxM)
                                         : missed_between(box.width(1), 2 * sxS * sxS, sxS);
    const double lag_absolute = is_force ? missed_between(box.width(1), 2 * sM * S * sy, M * sy)
                                         : missed_between(box.width(1), 2 * sxS * S * sy, S * sy);
    keep_smaller(bends, k, 1, lag_relative, lag_absolute, at_centre);
    const double delay_relative = box.width(2) / 2 * sM;
    const double delay_absolute = missed_between(box.width(2), sM * (1 + 2 * M) * sy, M * sy);
    keep_smaller(bends, k, 2, delay_relative, delay_absolute, at_centre);
  }
  // On the edge of least thrust, absolute bends refer to r y.
  if (box.edge == PlantEdge::kLeastThrust) {
    for (PlantPoint& absolute : bends.absolute) {
      for (double& bend : absolute) bend *= box.to[0];
    }
  }
  return bends;
}

}  // namespace swarmcert::stability
