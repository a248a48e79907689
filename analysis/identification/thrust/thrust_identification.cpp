#include "analysis/identification/thrust/thrust_identification.h"

#include <fmt/core.h>

#include <Eigen/Dense>
#include <algorithm>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <map>

#include "controller/battery.h"

namespace swarmcert::analysis {
namespace {

constexpr double kSmallestSingularValue = 1e-6;
constexpr double kSmallestPwmSpan = 0.2;
constexpr double kSmallestVoltageSpan_V = 0.1;
constexpr double kLargestUncertainty = 0.1;  // of the largest measured value
constexpr double kEmpty_V = 3.2, kFull_V = 4.2;
constexpr double kReachesFull = 0.98;
constexpr int kFewestRamps = 3;

using Row = Eigen::VectorXd;

Row quadratic_row(double x, double y) {
  Row row(5);
  row << 1, x, y, x * x, x * y;
  return row;
}

Row linear_row(double x, double y) {
  Row row(3);
  row << 1, x, y;
  return row;
}

/// A least squares problem, and the range where its polynomial will be used.
struct Problem {
  std::vector<std::string> names;
  std::vector<Row> rows;
  std::vector<double> targets;
  std::vector<Row> used_at;
  std::string method, unit;
  double scale = 0;           ///< largest measured value of the fitted quantity
  std::vector<Row> higher{};  ///< terms of the next order, one row per row; empty: lack of fit is not tested
};

/// The terms that quadratic_row() lacks.
Row cubic_terms(double x, double y) {
  Row row(5);
  row << x * x * x, x * x * y, x * y * y, y * y, y * y * y;
  return row;
}

/// Sum of squares and their number within repeated rows, about the mean of each group.
struct PureError {
  double squares = 0;
  int freedom = 0, groups = 0;
};
PureError pure_error(const Problem& problem) {
  std::map<std::vector<double>, std::vector<double>> targets;
  for (std::size_t i = 0; i < problem.rows.size(); ++i) {
    const Row& row = problem.rows[i];
    targets[{row.begin(), row.end()}].push_back(problem.targets[i]);
  }
  PureError error;
  error.groups = static_cast<int>(targets.size());
  for (const auto& [row, repeated] : targets) {
    double sum = 0;
    for (const double target : repeated) sum += target;
    const double mean = sum / static_cast<double>(repeated.size());
    for (const double target : repeated) error.squares += (target - mean) * (target - mean);
    error.freedom += static_cast<int>(repeated.size()) - 1;
  }
  return error;
}

LackOfFit lack_of(const Problem& problem, const Eigen::MatrixXd& a, const Eigen::VectorXd& residual) {
  constexpr int kFewestRepeats = 10;
  constexpr double kRounding = 1e-9;  // of the largest measured value
  LackOfFit lack;
  const auto n = static_cast<int>(a.rows()), k = static_cast<int>(a.cols());
  if (problem.higher.empty()) return lack;
  const double squares = residual.squaredNorm();
  double noise = 0;
  const PureError repeated = pure_error(problem);
  if (repeated.freedom >= kFewestRepeats && repeated.groups > k) {
    lack.against = "repeated rows";
    lack.terms = repeated.groups - k;
    lack.left = repeated.freedom;
    noise = repeated.squares;
  } else {
    const auto more = static_cast<int>(problem.higher[0].size());
    if (n <= k + more) return lack;
    Eigen::MatrixXd all(n, k + more);
    all.leftCols(k) = a;
    for (int i = 0; i < n; ++i)
      all.row(i).tail(more) = problem.higher[static_cast<std::size_t>(i)].transpose();
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(all);
    lack.against = "terms of the next order";
    lack.terms = static_cast<int>(qr.rank()) - k;
    lack.left = n - static_cast<int>(qr.rank());
    if (lack.terms < 1) return {};
    noise = (residual - all * qr.solve(residual)).squaredNorm();
  }
  const double lacking = std::max(0.0, squares - noise);
  lack.rms = std::sqrt(lacking / n);
  if (std::sqrt(squares / n) < kRounding * problem.scale) return lack;
  lack.F = lacking / lack.terms / std::max(noise / lack.left, 1e-300);
  lack.chance = boost::math::cdf(complement(boost::math::fisher_f(lack.terms, lack.left), lack.F));
  return lack;
}

/// Fits without checking the excitation.
struct Solution {
  PolynomialFit fit;
  Eigen::VectorXd values;
  Eigen::MatrixXd covariance;
  double quantile = 0;
};

Solution solve(const Problem& problem, double confidence) {
  Solution s;
  PolynomialFit& fit = s.fit;
  fit.method = problem.method;
  fit.unit = problem.unit;
  const auto n = static_cast<Eigen::Index>(problem.rows.size());
  const auto k = static_cast<Eigen::Index>(problem.names.size());
  fit.samples = static_cast<int>(n);
  if (n <= k) {
    fit.why_not = fmt::format("{} rows for {} coefficients; at least {} are needed", n, k, k + 1);
    return s;
  }
  Eigen::MatrixXd a(n, k);
  Eigen::VectorXd b(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    a.row(i) = problem.rows[static_cast<std::size_t>(i)].transpose();
    b[i] = problem.targets[static_cast<std::size_t>(i)];
  }
  const Eigen::VectorXd scale = a.colwise().norm().transpose().cwiseMax(1e-300);
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(a * scale.cwiseInverse().asDiagonal(),
                                              Eigen::ComputeThinU | Eigen::ComputeThinV);
  const Eigen::VectorXd& singular = svd.singularValues();
  if (!(singular[k - 1] > kSmallestSingularValue)) {
    fit.why_not = fmt::format(
        "the columns of the fit depend on each other (smallest singular value {:.1e}): vary PWM and battery "
        "voltage independently, at three PWM levels or more",
        singular[k - 1]);
    return s;
  }
  s.values = scale.cwiseInverse().cwiseProduct(svd.solve(b));
  const Eigen::VectorXd residual = b - a * s.values;
  const double variance = residual.squaredNorm() / static_cast<double>(n - k);
  const Eigen::MatrixXd root =
      scale.cwiseInverse().asDiagonal() * svd.matrixV() * singular.cwiseInverse().asDiagonal();
  s.covariance = variance * root * root.transpose();
  s.quantile =
      boost::math::quantile(boost::math::students_t(static_cast<double>(n - k)), 0.5 + 0.5 * confidence);
  fit.residual_rms = std::sqrt(residual.squaredNorm() / static_cast<double>(n));
  fit.largest_residual = residual.cwiseAbs().maxCoeff();
  fit.lack = lack_of(problem, a, residual);
  for (const Row& row : problem.used_at) {
    const double half = s.quantile * std::sqrt(std::max(0.0, row.dot(s.covariance * row)));
    fit.largest_uncertainty = std::max(fit.largest_uncertainty, half);
  }
  if (!(fit.largest_uncertainty <= kLargestUncertainty * problem.scale)) {
    fit.why_not = fmt::format(
        "too noisy: in its range of use the uncertainty of the fit is {:.3g} {}, compared with {:.3g}",
        fit.largest_uncertainty, fit.unit, problem.scale);
    return s;
  }
  fit.determined = true;
  for (Eigen::Index i = 0; i < k; ++i) {
    const double half = s.quantile * std::sqrt(s.covariance(i, i));
    fit.coefficients.push_back(
        {problem.names[static_cast<std::size_t>(i)], s.values[i], s.values[i] - half, s.values[i] + half});
  }
  return s;
}

/// Returns what the experiment lacks for any fit; empty if nothing.
std::string poor_excitation(const ThrustIdentification& range) {
  const double volts = (range.largest_v - range.smallest_v) * controller::kReferenceVoltage_V;
  if (range.largest_p - range.smallest_p < kSmallestPwmSpan) {
    return fmt::format("PWM spans {:.3f} only; at least {} is needed", range.largest_p - range.smallest_p,
                       kSmallestPwmSpan);
  }
  if (volts < kSmallestVoltageSpan_V) {
    return fmt::format("the battery spans {:.3f} V only; at least {} V is needed: measure from full to empty",
                       volts, kSmallestVoltageSpan_V);
  }
  return "";
}

/// Returns the rows of ramps that reach full PWM, with the largest thrust of their ramp as target.
Problem ramps_to_full_pwm(const ThrustData& data, int& ramps) {
  Problem problem{{"e00", "e10", "e01"}, {}, {}, {}, "largest thrust of each ramp to full PWM", "gf", 0};
  ramps = 0;
  const std::vector<ThrustSample>& s = data.samples;
  for (std::size_t begin = 0, end = 0; begin < s.size(); begin = end) {
    double largest_p = s[begin].p, largest_thrust = s[begin].thrust_gf;
    for (end = begin + 1; end < s.size(); ++end) {
      if (data.has_runs ? s[end].run != s[begin].run : s[end].p < s[end - 1].p) break;
      largest_p = std::max(largest_p, s[end].p);
      largest_thrust = std::max(largest_thrust, s[end].thrust_gf);
    }
    if (largest_p < kReachesFull || end - begin < 3) continue;
    ++ramps;
    for (std::size_t i = begin; i < end; ++i) {
      problem.rows.push_back(linear_row(s[i].p, s[i].v));
      problem.targets.push_back(largest_thrust);
      problem.scale = std::max(problem.scale, largest_thrust);
    }
  }
  return problem;
}

/// Returns e00 = c00 + c10 + c20, e01 = c01 + c11, with intervals from the covariance of c.
PolynomialFit at_full_pwm(const Solution& thrust, double largest_p) {
  PolynomialFit fit;
  fit.method = "thrust polynomial at full PWM, without sag";
  fit.unit = "gf";
  fit.samples = thrust.fit.samples;
  if (!thrust.fit.determined) {
    fit.why_not = "no three ramps reach full PWM, and the thrust polynomial is not determined";
    return fit;
  }
  if (largest_p < kReachesFull) fit.method += fmt::format(", extrapolated from PWM {:.2f}", largest_p);
  fit.determined = true;
  fit.residual_rms = thrust.fit.residual_rms;
  fit.largest_residual = thrust.fit.largest_residual;
  Eigen::VectorXd e00(5), e01(5);
  e00 << 1, 1, 0, 1, 0;
  e01 << 0, 0, 1, 0, 1;
  const auto coefficient = [&](const std::string& name, const Eigen::VectorXd& weights) {
    const double half = thrust.quantile * std::sqrt(std::max(0.0, weights.dot(thrust.covariance * weights)));
    const double value = weights.dot(thrust.values);
    return Coefficient{name, value, value - half, value + half};
  };
  for (const double volts : {kEmpty_V, kFull_V}) {
    const Eigen::VectorXd row = e00 + volts / controller::kReferenceVoltage_V * e01;
    fit.largest_uncertainty =
        std::max(fit.largest_uncertainty,
                 thrust.quantile * std::sqrt(std::max(0.0, row.dot(thrust.covariance * row))));
  }
  fit.coefficients = {coefficient("e00", e00), {"e10", 0, 0, 0}, coefficient("e01", e01)};
  return fit;
}

}  // namespace

namespace {

/// The cubic in the motors' voltage. Its next order are the fourth power and what depends on the battery alone.
PolynomialFit of_motor_voltage(const ThrustData& data, double confidence) {
  Problem cubic{{"VMOTOR2THRUST0", "VMOTOR2THRUST1", "VMOTOR2THRUST2", "VMOTOR2THRUST3"},
                {},
                {},
                {},
                "thrust to the voltage of the motor",
                "N",
                0};
  const auto row_of = [](double u) {
    Row row(4);
    row << 1, u, u * u, u * u * u;
    return row;
  };
  double least_V = 1e300, most_V = 0;
  for (const ThrustSample& s : data.samples) {
    const double battery_V = s.v * controller::kReferenceVoltage_V, u = s.p * battery_V;
    cubic.rows.push_back(row_of(u));
    cubic.targets.push_back(s.thrust_gf * controller::kNewtonPerGramForce);
    Row higher(3);
    higher << u * u * u * u, battery_V, battery_V * u;
    cubic.higher.push_back(higher);
    cubic.scale = std::max(cubic.scale, std::abs(cubic.targets.back()));
    least_V = std::min(least_V, u);
    most_V = std::max(most_V, u);
  }
  cubic.used_at = {row_of(least_V), row_of(most_V)};
  return solve(cubic, confidence).fit;
}

}  // namespace

ThrustIdentification identify_thrust(const ThrustData& data, double confidence) {
  ThrustIdentification result;
  result.confidence = confidence;
  Problem thrust{{"c00", "c10", "c01", "c20", "c11"}, {}, {}, {}, "thrust to PWM and voltage", "gf", 0};
  Problem pwm{{"d00", "d10", "d01", "d20", "d11"}, {}, {}, {}, "PWM to thrust and voltage", "PWM / 65536", 0};
  result.smallest_p = result.smallest_v = 1e300;
  double smallest_gf = 1e300, largest_gf = -1e300;
  for (const ThrustSample& s : data.samples) {
    result.smallest_p = std::min(result.smallest_p, s.p);
    result.largest_p = std::max(result.largest_p, s.p);
    result.smallest_v = std::min(result.smallest_v, s.v);
    result.largest_v = std::max(result.largest_v, s.v);
    smallest_gf = std::min(smallest_gf, s.thrust_gf);
    largest_gf = std::max(largest_gf, s.thrust_gf);
    thrust.rows.push_back(quadratic_row(s.p, s.v));
    thrust.targets.push_back(s.thrust_gf);
    thrust.higher.push_back(cubic_terms(s.p, s.v));
    pwm.rows.push_back(quadratic_row(s.thrust_gf, s.v));
    pwm.targets.push_back(s.p);
    pwm.higher.push_back(cubic_terms(s.thrust_gf, s.v));
  }
  thrust.scale = std::max(std::abs(smallest_gf), std::abs(largest_gf));
  pwm.scale = result.largest_p;
  for (const double volts : {kEmpty_V, kFull_V}) {
    const double v = volts / controller::kReferenceVoltage_V;
    for (const double p : {result.smallest_p, result.largest_p})
      thrust.used_at.push_back(quadratic_row(p, v));
    for (const double g : {smallest_gf, largest_gf}) pwm.used_at.push_back(quadratic_row(g, v));
  }

  const std::string poor = poor_excitation(result);
  Solution thrust_solution = solve(thrust, confidence);
  result.pwm = solve(pwm, confidence).fit;
  if (!poor.empty()) {
    for (PolynomialFit* fit : {&thrust_solution.fit, &result.pwm}) {
      fit->determined = false;
      fit->why_not = poor;
      fit->coefficients.clear();
    }
  }
  result.thrust = thrust_solution.fit;
  result.motor_voltage = of_motor_voltage(data, confidence);

  int ramps = 0;
  Problem largest = ramps_to_full_pwm(data, ramps);
  for (const double volts : {kEmpty_V, kFull_V}) {
    for (const double p : {0.0, 1.0}) {
      largest.used_at.push_back(linear_row(p, volts / controller::kReferenceVoltage_V));
    }
  }
  if (ramps >= kFewestRamps && poor.empty()) result.max_thrust = solve(largest, confidence).fit;
  if (!result.max_thrust.determined) result.max_thrust = at_full_pwm(thrust_solution, result.largest_p);
  return result;
}

}  // namespace swarmcert::analysis
