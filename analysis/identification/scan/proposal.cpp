#include "analysis/identification/scan/proposal.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "analysis/identification/box_least_squares.h"
#include "analysis/identification/scan/curve_fit.h"
#include "analysis/identification/scan/drag_law.h"

namespace swarmcert::identification {
namespace {

constexpr int kRamps = 7;

/// Returns K of "formula:K".
std::size_t place_of_name(const std::string& name) {
  const std::size_t colon = name.find(':');
  return colon == std::string::npos ? 1 : std::strtoul(name.c_str() + colon + 1, nullptr, 10);
}

double ramp(double value, double from, double step) { return std::clamp((value - from) / step, 0.0, 1.0); }

/// Fits offset and ramps by least squares; with ramps of a single sign if that is hardly worse.
Eigen::VectorXd ramps_of(const ScanSamples& samples, const ScanEntry& entry, const Knots& knots,
                         bool& is_monotone) {
  constexpr double kHardlyMore = 1.01;
  const auto column = static_cast<Eigen::Index>(entry.variables[0]);
  const double step = knots[1] - knots[0];
  const auto size = static_cast<Eigen::Index>(kRamps + 1);
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(size, size);
  Eigen::VectorXd b = Eigen::VectorXd::Zero(size), row(size);
  double squares = 0;
  for (Eigen::Index i = 0; i < samples.size(); ++i) {
    row[0] = 1;
    for (int k = 0; k < kRamps; ++k)
      row[k + 1] = ramp(samples.values(i, column), knots[static_cast<std::size_t>(k)], step);
    gram.noalias() += row * row.transpose();
    b += samples.residual(i, entry.column) * row;
    squares += std::pow(samples.residual(i, entry.column), 2);
  }
  gram.diagonal().array() += 1e-9 + 2.0;  // as weak as two samples
  const auto fit = [&](double lower, double upper) {
    Eigen::VectorXd least = Eigen::VectorXd::Constant(size, lower),
                    most = Eigen::VectorXd::Constant(size, upper);
    least[0] = -1;
    most[0] = 1;
    return box_least_squares(gram, b, least, most);
  };
  const auto left = [&](const Eigen::VectorXd& c) { return squares - 2 * c.dot(b) + c.dot(gram * c); };
  const Eigen::VectorXd free = fit(-1, 1), rising = fit(0, 1), falling = fit(-1, 0);
  const Eigen::VectorXd& best = left(rising) < left(falling) ? rising : falling;
  is_monotone = left(best) <= kHardlyMore * left(free);
  return is_monotone ? best : free;
}

}  // namespace

bool is_proposal(const std::string& name) {
  for (const std::string kind : {"formula", "shape"}) {
    if (name == kind) return true;
    if (name.rfind(kind + ":", 0) != 0) continue;
    const std::string number = name.substr(kind.size() + 1);
    const bool is_number =
        !number.empty() && number.size() < 4 && number.find_first_not_of("0123456789") == std::string::npos;
    return is_number && std::strtol(number.c_str(), nullptr, 10) > 0;
  }
  return false;
}

std::optional<stability::EffectSpec> shape_of(const ScanSamples& samples, const ScanEntry& entry) {
  if (entry.variables.size() != 1) return std::nullopt;
  const ScanVariableInfo& info = scan_variable(entry.variables[0]);
  const Knots knots =
      knots_over(samples.values.col(static_cast<Eigen::Index>(entry.variables[0])), kRamps + 1);
  if (info.symbol[0] == '\0' || knots.empty()) return std::nullopt;
  bool is_monotone = false;
  const Eigen::VectorXd c = ramps_of(samples, entry, knots, is_monotone);
  stability::EffectSpec spec;
  spec.name =
      fmt::format("shape_{}{}_of_{}", entry.frame == "body" ? "body_" : "", entry.axis, entry.variable);
  const double most_N = 4 * c.cwiseAbs().maxCoeff() + 1e-3;
  std::string text;
  const double step = knots[1] - knots[0];
  for (int k = 0; k <= kRamps; ++k) {
    const std::string name = k == 0 ? "offset_N" : fmt::format("ramp_{}_N", k);
    spec.parameters[name] = c[k];
    spec.expression.linear.push_back(name);
    const bool rises = c.tail(kRamps).sum() > 0, bounded = k > 0 && is_monotone;
    spec.expression.bounds[name] = {bounded && rises ? 0 : -most_N, bounded && !rises ? 0 : most_N};
    text += k == 0 ? name
                   : fmt::format(" + {} * min(max(({} - ({:.6g})) / {:.6g}, 0), 1)", name, info.symbol,
                                 knots[static_cast<std::size_t>(k - 1)], step);
  }
  spec.expression.formulas[scan_columns(samples.quantity)[static_cast<std::size_t>(entry.column)].target] =
      text;
  return spec;
}

std::optional<stability::EffectSpec> proposal(const Passes& passes,
                                              const std::vector<stability::EffectSpec>& specs,
                                              const std::string& name) {
  const ScanSamples samples = scan_samples(passes, specs);
  const Scan found = scan(samples, passes.jobs, Judges::kOtherFlights);
  std::size_t place = place_of_name(name);
  if (name.rfind("shape", 0) == 0) {
    for (const ScanEntry& entry : found.entries) {
      std::optional<stability::EffectSpec> shape = shape_of(samples, entry);
      if (shape && --place == 0) return shape;
    }
    return std::nullopt;
  }
  std::vector<Formula> formulas = find_formulas(samples, found, kMostFormulas, passes.jobs);
  prefer_drag_law(samples, formulas);
  if (formulas.size() < place) return std::nullopt;
  return formulas[place - 1].effect;
}

stability::EffectSpec switched_off(stability::EffectSpec effect) {
  for (const std::string& name : effect.expression.linear) effect.parameters[name] = 0;
  effect.fit = {};
  return effect;
}

}  // namespace swarmcert::identification
