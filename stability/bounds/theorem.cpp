#include "stability/bounds/theorem.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "stability/gains_matrices.h"

namespace swarmcert::stability {
namespace {

/// Tolerance for gains, printed with few digits, to be accepted as a (Lambda, K) form: relative, in Ki.
constexpr double kFormTolerance = 1e-9;
constexpr char kAxes[] = "xyz";

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

/// Returns the smallest eigenvalue if `m` is symmetric and positive definite; else adds an objection.
std::optional<double> positive_definite(const Matrix3& m, const char* name,
                                        std::vector<std::string>& why_not) {
  const Eigen::Matrix3d matrix = to_eigen(m);
  const double asymmetry = (matrix - matrix.transpose()).cwiseAbs().maxCoeff();
  if (asymmetry > 1e-12 * matrix.cwiseAbs().maxCoeff()) {
    why_not.push_back(std::string(name) + " is not symmetric: entries differ by " + number(asymmetry) +
                      ". For such gains the ball can be exceeded");
    return std::nullopt;
  }
  const double least =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(matrix, Eigen::EigenvaluesOnly).eigenvalues()[0];
  if (least > 0) return least;
  why_not.push_back(std::string(name) + " is not positive definite: its smallest eigenvalue is " +
                    number(least));
  return std::nullopt;
}

/// Returns the diagonal (Lambda, K) of PID gains whose effective Ki is `share` of the written one; else adds an
/// objection.
std::optional<CompositeGains> composite_of(const PidGains& pid, double share, double mass_kg,
                                           std::vector<std::string>& why_not) {
  CompositeGains result{};
  bool has_form = true;
  for (std::size_t i = 0; i < 3; ++i) {
    const controller::AxisPid<double> pid_axis = {pid.Kp_1_s2[i], pid.Kd_1_s[i], pid.Ki_1_s3[i] * share};
    const controller::AxisComposite<double> axis =
        controller::to_composite(pid_axis, mass_kg, kFormTolerance);
    if (axis.status == controller::ConversionStatus::kOk) {
      result.Lambda_1_s[i][i] = axis.lambda_1_s;
      result.K_kg_s[i][i] = axis.k_kg_s;
      continue;
    }
    has_form = false;
    std::string why = std::string("the gains of axis ") + kAxes[i] + " have no (Lambda, K) form: ";
    if (axis.status == controller::ConversionStatus::kOtherIntegralGain) {
      why += "Ki = " + number(pid_axis.Ki_1_s3) + ", but Kp, Kd would need " + number(axis.needed_Ki_1_s3);
    } else {
      why += controller::to_text(axis.status);
    }
    why_not.push_back(why);
  }
  if (!has_form) return std::nullopt;
  return result;
}

}  // namespace

namespace {

/// Returns why the clamps of the integrators violate the hypotheses, an objection per axis.
void object_to_clamps(const FlownLoop& loop, const std::optional<PerAxis>& needs_m_s, Theorem& theorem) {
  for (int axis = 0; axis < 3; ++axis) {
    const double limit = loop.integrator_limit_m_s(axis);
    const auto i = static_cast<std::size_t>(axis);
    if (std::isinf(limit) || (needs_m_s && (*needs_m_s)[i] <= limit)) continue;
    std::string why =
        std::string("the integrator of axis ") + kAxes[i] + " is clamped at " + number(limit) + " m s";
    if (needs_m_s) why += ", but the disturbance can demand " + number((*needs_m_s)[i]);
    theorem.why_not.push_back(why);
  }
}

void object_to_sampling(const FlownLoop& loop, Theorem& theorem) {
  const double radius = loop.spectral_radius();
  if (radius < 1) return;
  theorem.why_not.push_back("sampled at " + number(loop.gains.rate_hz) +
                            " Hz the loop diverges: its spectral radius is " + number(radius));
}

/// Visits one fact of the loop: sets the gains, or adds an objection if the theorem's loop lacks it.
void visit(Fact fact, const FlownLoop& loop, const std::optional<PerAxis>& needs_m_s, Theorem& theorem) {
  const Gains& gains = loop.gains;
  const auto object = [&theorem](const std::string& why) { theorem.why_not.push_back(why); };
  switch (fact) {
    case Fact::kGainsOfLaw:
      theorem.composite = gains.composite ? gains.composite
                                          : composite_of(*gains.pid, loop.integral_share(),
                                                         loop.told_mass_kg(), theorem.why_not);
      return;
    case Fact::kSampling:
      return object_to_sampling(loop, theorem);
    case Fact::kIntegratorStep:
      if (!gains.composite) return;  // converted with the Ki that acts
      return object("the integrator adds " + number(gains.integrator_step_s) + " s per cycle of " +
                    number(1 / gains.rate_hz) + " s: the effective Lambda^2 is " +
                    number(loop.integral_share()) + " times the written one, which has no (Lambda, K) form");
    case Fact::kIntegratorClamp:
      return object_to_clamps(loop, needs_m_s, theorem);
    case Fact::kMotorLag:
      return object("thrust lags by " + number(gains.motor_lag_s) + " s");
    case Fact::
        kAttitude:  // without a lag, a condition of every statement: see assume() in tracking_bounds.cpp
      if (gains.attitude_lag_s == 0) return;
      return object("the thrust's direction lags by " + number(gains.attitude_lag_s) + " s");
    case Fact::kDelay:
      return object("the force is delayed by " + number(gains.delay_s) + " s");
    case Fact::kNetworkRate:
      return object("the learned force is a staircase of " + number(gains.network_rate_hz) +
                    " Hz, whose rate is not bounded");
    case Fact::kNetworkLatency:
      return object("the learned force is " + number(gains.network_latency_s) + " s old when applied");
    case Fact::kThrustScale:
      return object("the actual force is not the commanded force: thrust scale " +
                    number(loop.command_scale()));
    case Fact::kThrustLimits:
      return;  // a hypothesis on the flight, judged by saturation.h
  }
}

}  // namespace

Theorem check_theorem(const FlownLoop& loop, const std::optional<PerAxis>& integrator_needs_m_s) {
  Theorem theorem;
  for (const Fact fact : loop.facts()) visit(fact, loop, integrator_needs_m_s, theorem);
  if (theorem.composite) {
    const auto least_Lambda = positive_definite(theorem.composite->Lambda_1_s, "Lambda", theorem.why_not);
    const auto least_K = positive_definite(theorem.composite->K_kg_s, "K", theorem.why_not);
    if (least_Lambda && least_K) {
      theorem.min_Lambda = *least_Lambda;
      theorem.min_K = *least_K;
    } else {
      theorem.composite.reset();
    }
  }
  theorem.applies = theorem.why_not.empty() && theorem.composite.has_value();
  return theorem;
}

std::optional<double> flown_ball_per_rate(const FlownLoop& loop, const Theorem& theorem) {
  if (!theorem.applies) return std::nullopt;
  if (!loop.is_sampled()) return theorem.ball_per_rate();
  // |(a, b, c)| <= root of the sum of squares of the groups of equal loops: equal loops are one loop of a vector.
  std::vector<SampledLoop> groups;
  double square = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const std::optional<SampledLoop> one = loop.sampled(axis);
    if (!one) return std::nullopt;
    const auto is_same = [&one](const SampledLoop& other) { return other.plant == one->plant; };
    if (std::any_of(groups.begin(), groups.end(), is_same)) continue;
    groups.push_back(*one);
    const double rate = std::max(sampled_norms(*one, Channel::kForce, Instants::kAll).rate,
                                 sampled_norms(*one, Channel::kCommand, Instants::kAll).rate);
    square += rate * rate;
  }
  return std::sqrt(square);
}

namespace {

/// h(t) m = int_0^t (t - u) e^(-l(t - u)) e^(-au) du
double kernel(double l, double a, double t) {
  const double x = (a - l) * t;
  if (std::abs(x) > 0.5) {
    const double difference = a - l;
    return (std::exp(-a * t) - std::exp(-l * t) + difference * t * std::exp(-l * t)) /
           (difference * difference);
  }
  // t^2 e^(-lt) (e^(-x) - 1 + x)/x^2 by its series, which avoids cancellation.
  double term = 0.5;
  double total = term;
  for (int n = 3; n < 25; ++n) {
    term *= -x / n;
    total += term;
  }
  return t * t * std::exp(-l * t) * total;
}

double kernel_integral(double l, double a, double t) {
  const double difference = a - l;
  if (std::abs(difference) > 0.02 * l) {
    const double decayed_l = std::exp(-l * t);
    return (1 - std::exp(-a * t)) / (a * difference * difference) -
           (1 - decayed_l) / (l * difference * difference) +
           (1 - decayed_l * (1 + l * t)) / (l * l * difference);
  }
  // For nearly equal rates the closed form cancels; Simpson's rule on the smooth kernel does not.
  constexpr int kCells = 6000;
  const double horizon = std::min(t, 60 / std::min(l, a));
  const double step = horizon / kCells;
  double total = kernel(l, a, 0) + kernel(l, a, horizon);
  for (int i = 1; i < kCells; ++i) total += (i % 2 == 1 ? 4 : 2) * kernel(l, a, i * step);
  return total * step / 3;
}

}  // namespace

double Transient::at(double t_s) const {
  const double a = k / mass_kg;
  const double decayed = std::exp(-l * t_s);
  return (1 + l * t_s) * decayed * error_m + t_s * decayed * speed_m_s + kernel(l, a, t_s) * s_dot_m_s2 +
         rate_N_s / mass_kg * kernel_integral(l, a, t_s);
}

double Transient::decay_1_s() const { return std::min(k / mass_kg, l); }

}  // namespace swarmcert::stability
