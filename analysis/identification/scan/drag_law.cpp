#include "analysis/identification/scan/drag_law.h"

#include <algorithm>
#include <cmath>

#include "analysis/identification/scan/formula_trial.h"

namespace swarmcert::identification {
namespace {

/// Dry friction has the exponent 0, drag at high speed 2. An exponent at an end of this wide range is no drag law.
constexpr double kLeastExponent = 0.3, kMostExponent = 4.7, kExponentStep = 0.05;

/// The part of the residual force along the velocity, and the speed.
struct AlongVelocity {
  Eigen::VectorXd force_N, speed_m_s;
  double mean_square_N2 = 0;  ///< of the whole force
};

AlongVelocity along_velocity_of(const ScanSamples& samples, const FixedDrag& beside) {
  AlongVelocity along;
  along.force_N.resize(samples.size());
  along.speed_m_s.resize(samples.size());
  for (Eigen::Index i = 0; i < samples.size(); ++i) {
    const Eigen::Vector3d v_m_s =
        samples.values.row(i).segment<3>(static_cast<Eigen::Index>(ScanVariable::kVx)).cast<double>();
    const double speed_m_s = v_m_s.norm();
    const Eigen::Vector3d force_N = samples.residual.row(i).head<3>().transpose().cast<double>() -
                                    (beside.linear_N_s_m + beside.quadratic_N_s2_m2 * speed_m_s) * v_m_s;
    along.speed_m_s[i] = speed_m_s;
    along.force_N[i] = speed_m_s > 0 ? force_N.dot(v_m_s) / speed_m_s : 0;
    along.mean_square_N2 += force_N.squaredNorm() / static_cast<double>(samples.size());
  }
  return along;
}

/// Returns the mean square that a force a |v|^exponent along the velocity leaves, and a.
std::pair<double, double> fit_of(const AlongVelocity& along, double exponent) {
  const Eigen::ArrayXd power = along.speed_m_s.array().pow(exponent);
  const double product = (power * along.force_N.array()).sum(), square = power.square().sum();
  if (!(square > 0)) return {along.mean_square_N2, 0};
  const double explained = product * product / square / static_cast<double>(power.size());
  return {along.mean_square_N2 - explained, product / square};
}

stability::EffectSpec spec_of_power(double exponent, double drag_N) {
  stability::EffectSpec spec;
  spec.name = kDragLaw;
  add_coefficient("drag_N", drag_N, spec);
  spec.parameters["exponent"] = exponent;
  spec.expression.bounds["exponent"] = {kLeastExponent, kMostExponent};
  for (const double step : {-0.2, 0.0, 0.2})
    spec.expression.grid["exponent"].push_back(std::clamp(exponent + step, kLeastExponent, kMostExponent));
  for (const char axis : {'x', 'y', 'z'})
    spec.expression.formulas[std::string("force_") + axis + "_N"] =
        std::string("-drag_N * max(speed, 0.001)^(exponent - 1) * v") + axis;
  return spec;
}

}  // namespace

std::optional<DragLaw> drag_law(const ScanSamples& samples, const FixedDrag& beside) {
  if (samples.size() == 0 || samples.quantity != ScanQuantity::kForce) return std::nullopt;
  const AlongVelocity along = along_velocity_of(samples, beside);
  DragLaw law;
  law.mean_square_N2 = along.mean_square_N2;
  double force_N = 0;
  const int steps = static_cast<int>(std::lround((kMostExponent - kLeastExponent) / kExponentStep));
  for (int i = 0; i <= steps; ++i) {
    const double exponent = kLeastExponent + i * kExponentStep;
    const auto [left_N2, at_1_m_s] = fit_of(along, exponent);
    if (!(left_N2 < law.mean_square_N2)) continue;
    law.mean_square_N2 = left_N2;
    law.exponent = exponent;
    force_N = at_1_m_s;
  }
  const bool is_inside = law.exponent > kLeastExponent && law.exponent < kMostExponent - 0.5 * kExponentStep;
  if (!(force_N < 0) || !is_inside) return std::nullopt;
  const double independent = std::max(kIndependentSamples * static_cast<double>(samples.size()), 4.0);
  const double left = std::max(law.mean_square_N2 / along.mean_square_N2, 1e-12);
  law.formula.form = "power";
  law.formula.variable = "speed";
  law.formula.share = 1 - left;
  law.formula.saved_bits = -0.5 * independent * std::log2(left) - std::log2(independent);
  law.formula.effect = spec_of_power(law.exponent, -force_N);
  return law;
}

void prefer_drag_law(const ScanSamples& samples, std::vector<Formula>& formulas) {
  std::optional<DragLaw> law = drag_law(samples, {});
  const bool is_best = law && std::all_of(formulas.begin(), formulas.end(), [&](const Formula& other) {
                         return other.share < law->formula.share;
                       });
  if (is_best) formulas.insert(formulas.begin(), std::move(law->formula));
}

double mean_square_N2(const ScanSamples& samples) {
  if (samples.size() == 0) return 0;
  return samples.residual.leftCols<3>().cast<double>().squaredNorm() / static_cast<double>(samples.size());
}

}  // namespace swarmcert::identification
