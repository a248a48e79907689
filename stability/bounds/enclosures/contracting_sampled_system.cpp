#include "stability/bounds/enclosures/contracting_sampled_system.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace swarmcert::stability {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// Returns exp(G t) of an interval matrix: the Taylor sum of G t / 2^k, whose row sums are at most 1/4, squared k
/// times. The truncation error is below 0.25^18/18! (1 + 1/64) < 3e-27 in the row-sum norm, and hence in every entry.
IntervalMatrix exponential(const IntervalMatrix& generator, Interval t) {
  const std::size_t n = generator.size();
  IntervalMatrix scaled = generator * t;
  double largest = 0;
  for (std::size_t i = 0; i < n; ++i) {
    double row = 0;
    for (std::size_t j = 0; j < n; ++j) row = up(row + scaled(i, j).mag());
    largest = std::max(largest, row);
  }
  int halvings = 0;
  while (std::ldexp(largest, -halvings) > 0.25) ++halvings;
  IntervalMatrix total = exponential_sum(scaled * Interval(std::ldexp(1.0, -halvings)));
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) total(i, j) += Interval(-3e-27, 3e-27);
  }
  for (int i = 0; i < halvings; ++i) total = total * total;
  return total;
}

MatrixXd centre_of(const IntervalMatrix& m) {
  MatrixXd result(static_cast<Index>(m.size()), static_cast<Index>(m.columns()));
  for (std::size_t i = 0; i < m.size(); ++i) {
    for (std::size_t j = 0; j < m.columns(); ++j) {
      result(static_cast<Index>(i), static_cast<Index>(j)) = middle(m(i, j));
    }
  }
  return result;
}

}  // namespace

IntervalSampledModel::IntervalSampledModel(const SampledLoop& loop) : generator_(0), control_(0), hold_(0) {
  std::vector<double> lags_s;
  for (const double tau : loop.plant.lags_s) {
    if (tau > 0) lags_s.push_back(tau);
  }
  const bool integrates = loop.plant.Ki > 0;
  plant_ = 2 + lags_s.size();
  command_ = plant_ + (integrates ? 1 : 0);
  const double whole = std::floor(loop.plant.delay_s / loop.period_s + 1e-9);
  newest_ = static_cast<std::size_t>(whole);
  shift_s_ = Interval(loop.plant.delay_s) - Interval(whole) * Interval(loop.period_s);
  const bool is_shifted = loop.plant.delay_s - whole * loop.period_s >= 1e-9 * loop.period_s;
  if (!is_shifted) shift_s_ = 0;
  past_ = newest_ + (is_shifted ? 1 : 0);

  generator_ = IntervalMatrix(plant_ + 1);
  generator_(0, 1) = 1;
  generator_(1, 2) = 1;
  for (std::size_t i = 0; i < lags_s.size(); ++i) {
    const Interval rate = Interval(1) / Interval(lags_s[i]);
    generator_(2 + i, 2 + i) = -rate;
    generator_(2 + i, 3 + i) = rate;
  }
  control_ = IntervalMatrix(size() + 1, size());
  for (std::size_t i = 0; i < command_; ++i) control_(i, i) = 1;
  control_(command_, 0) = -Interval(loop.plant.Kp);
  control_(command_, 1) = -Interval(loop.plant.Kd);
  if (integrates) {
    const std::size_t integral = plant_;
    control_(integral, 0) = loop.integrator_step_s;
    control_(command_, 0) =
        -(Interval(loop.plant.Kp) + Interval(loop.plant.Ki) * Interval(loop.integrator_step_s));
    control_(command_, integral) = -Interval(loop.plant.Ki);
  }
  for (std::size_t i = 0; i < past_; ++i) control_(command_ + 1 + i, command_ + i) = 1;

  hold_ = IntervalMatrix(size(), size() + 1);
  const IntervalMatrix plant = plant_at(loop.period_s);
  for (std::size_t i = 0; i < plant_; ++i) {
    for (std::size_t j = 0; j <= size(); ++j) hold_(i, j) = plant(i, j);
  }
  if (integrates) hold_(plant_, plant_) = 1;
  for (std::size_t i = 0; i < past_; ++i) hold_(command_ + i, command_ + i) = 1;
}

IntervalMatrix IntervalSampledModel::plant_at(Interval phase_s) const {
  IntervalMatrix result(plant_, size() + 1);
  for (std::size_t i = 0; i < plant_; ++i) result(i, i) = 1;
  const auto advance = [&](Interval duration_s, std::size_t command) {
    const IntervalMatrix step = exponential(generator_, duration_s);
    IntervalMatrix next(plant_, size() + 1);
    for (std::size_t i = 0; i < plant_; ++i) {
      for (std::size_t j = 0; j <= size(); ++j) {
        for (std::size_t k = 0; k < plant_; ++k) next(i, j) += step(i, k) * result(k, j);
      }
      next(i, command_ + command) += step(i, plant_);
    }
    result = next;
  };
  // The order of the two may be uncertain due to round-off: the second segment then lasts from 0 to a rounding error.
  const Interval first_s(std::min(phase_s.lower, shift_s_.lower), std::min(phase_s.upper, shift_s_.upper));
  if (past_ > newest_) advance(first_s, newest_ + 1);
  const Interval rest_s = past_ > newest_ ? phase_s - first_s : phase_s;
  advance({std::max(0.0, rest_s.lower), std::max(0.0, rest_s.upper)}, newest_);
  return result;
}

IntervalVector IntervalSampledModel::error_at(double phase_s) const {
  const IntervalMatrix plant = plant_at(phase_s);
  IntervalVector row(size() + 1);
  for (std::size_t j = 0; j <= size(); ++j) row[j] = plant(0, j);
  return row;
}

std::optional<ContractingSampledSystem> contracting(const IntervalSampledModel& model) {
  const IntervalMatrix map = model.hold() * model.control();
  const MatrixXd approximate = centre_of(map);
  const Index n = approximate.rows();
  const double radius = Eigen::EigenSolver<MatrixXd>(approximate, false).eigenvalues().cwiseAbs().maxCoeff();
  if (!(radius < 1)) return std::nullopt;
  const double gamma = 1 - 0.8 * (1 - radius);
  // Scales the states to comparable units: w^k for the k-th derivative of e, w^2 = Kp.
  const auto command = static_cast<Index>(model.command_index());
  const double w = std::sqrt(std::max(1e-6, (std::abs(model.control()(model.command_index(), 0).lower))));
  Eigen::VectorXd unit = Eigen::VectorXd::Constant(n, 1 / (w * w));
  unit[0] = 1;
  unit[1] = 1 / w;
  if (model.command_index() == model.lags() + 3) unit[command - 1] = w;
  // P = sum_k (M/gamma)'^k (M/gamma)^k, by doubling, solves M'PM - gamma^2 P = -gamma^2 I.
  MatrixXd power = unit.asDiagonal() * approximate * unit.cwiseInverse().asDiagonal();
  power /= gamma;
  MatrixXd P = MatrixXd::Identity(n, n);
  for (int i = 0; i < 60 && power.norm() > 1e-12; ++i) {
    P += (power.transpose() * P * power).eval();
    power = (power * power).eval();
  }
  const Eigen::LLT<MatrixXd> factor(P);
  if (factor.info() != Eigen::Success || !P.allFinite()) return std::nullopt;
  const MatrixXd upper = factor.matrixU();
  const MatrixXd R = upper * unit.asDiagonal();
  const std::optional<IntervalMatrix> R_inverse = inverse(R);
  if (!R_inverse) return std::nullopt;
  ContractingSampledSystem system{IntervalMatrix(R) * map * *R_inverse, R, *R_inverse, 1};
  for (const double share : {0.95, 0.5, 0.1}) {
    const double bound = 1 - share * (1 - gamma);
    IntervalMatrix test(static_cast<std::size_t>(n));
    for (std::size_t i = 0; i < test.size(); ++i) {
      for (std::size_t j = 0; j < test.size(); ++j) {
        for (std::size_t k = 0; k < test.size(); ++k)
          test(i, j) = test(i, j) - system.A(k, i) * system.A(k, j);
        if (i == j) test(i, j) += Interval(bound) * Interval(bound);
      }
    }
    if (is_positive_definite(test)) {
      system.gamma = bound;
      return system;
    }
  }
  return std::nullopt;
}

}  // namespace swarmcert::stability
