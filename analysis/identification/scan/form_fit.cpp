#include "analysis/identification/scan/form_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "nn/base/doubles.h"

namespace swarmcert::identification {
namespace {

using Inputs2 = std::array<double, 2>;

Inputs2 inputs_at(const FormData& data, Eigen::Index i) {
  return {data.inputs(i, 0), data.inputs.cols() > 1 ? data.inputs(i, 1) : 0};
}

std::vector<std::vector<double>> combinations(const Form& form) {
  std::vector<std::vector<double>> all = {{}};
  for (const FormParameter& parameter : form.shape) {
    std::vector<std::vector<double>> longer;
    for (const std::vector<double>& theta : all) {
      for (const double start : parameter.starts) {
        longer.push_back(theta);
        longer.back().push_back(start);
      }
    }
    all = std::move(longer);
  }
  return all;
}

/// Returns the most promising combinations of starts, judged on a subset of the samples.
std::vector<std::vector<double>> best_starts(const Form& form, const FormData& data) {
  constexpr Eigen::Index kEnough = 600;
  constexpr std::size_t kTaken = 5;
  std::vector<std::vector<double>> starts = combinations(form);
  const Eigen::Index each = data.target.size() / kEnough;
  if (each < 2 || starts.size() <= kTaken) return starts;
  const auto some = Eigen::seq(0, data.target.size() - 1, each);
  FormData few;
  few.inputs = data.inputs(some, Eigen::all);
  few.target = data.target(some);
  if (data.factor.size() > 0) few.factor = data.factor(some);
  std::vector<FormFit> fits;
  for (const std::vector<double>& theta : starts) fits.push_back(fit_coefficients(form, few, theta));
  std::partial_sort(fits.begin(), fits.begin() + kTaken, fits.end(),
                    [](const FormFit& a, const FormFit& b) { return a.mean_square < b.mean_square; });
  starts.clear();
  for (std::size_t k = 0; k < kTaken; ++k) starts.push_back(std::move(fits[k].theta));
  return starts;
}

double first_step(const FormParameter& parameter, double value) {
  const std::vector<double>& starts = parameter.starts;
  if (parameter.lower == parameter.upper) return 0;
  if (starts.size() < 2) return 0.3 * std::abs(value);
  // Half the distance between starts there.
  double gap = kInfinity;
  for (std::size_t k = 1; k < starts.size(); ++k) {
    if (value <= starts[k] || k + 1 == starts.size()) {
      gap = starts[k] - starts[k - 1];
      break;
    }
  }
  return gap / 2;
}

FormFit improved(const Form& form, const FormData& data, FormFit best) {
  constexpr int kMostRounds = 60, kHalvings = 7;
  std::vector<double> steps;
  for (std::size_t k = 0; k < form.shape.size(); ++k)
    steps.push_back(first_step(form.shape[k], best.theta[k]));
  // The error only decreases, so a rejected theta is never better later.
  std::set<std::vector<double>> tried = {best.theta};
  int halved = 0;
  for (int round = 0; round < kMostRounds && halved < kHalvings; ++round) {
    bool moved = false;
    for (std::size_t k = 0; k < steps.size(); ++k) {
      for (const double sign : {1.0, -1.0}) {
        if (steps[k] == 0) continue;
        std::vector<double> theta = best.theta;
        theta[k] = std::clamp(theta[k] + sign * steps[k], form.shape[k].lower, form.shape[k].upper);
        if (!tried.insert(theta).second) continue;
        FormFit next = fit_coefficients(form, data, theta);
        if (!(next.mean_square < best.mean_square * (1 - 1e-9))) continue;
        best = std::move(next);
        moved = true;
        break;
      }
    }
    if (moved) continue;
    for (double& step : steps) step /= 2;
    ++halved;
  }
  return best;
}

}  // namespace

FormFit fit_coefficients(const Form& form, const FormData& data, const std::vector<double>& theta) {
  const auto functions = static_cast<Eigen::Index>(form.texts.size());
  const Eigen::Index size = functions + (form.has_offset ? 1 : 0);
  Eigen::Matrix3d gram = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  double squares = 0;
  // First values, then sums, which stay in registers.
  constexpr Eigen::Index kMany = 128;
  Eigen::Matrix<double, 3, kMany> rows = Eigen::Matrix<double, 3, kMany>::Zero();
  for (Eigen::Index first = 0; first < data.target.size(); first += kMany) {
    const Eigen::Index count = std::min(kMany, data.target.size() - first);
    for (Eigen::Index i = 0; i < count; ++i) {
      const Inputs2 v = inputs_at(data, first + i);
      form.values(v.data(), theta.data(), rows.col(i).data());
      if (data.factor.size() > 0) rows.col(i).head(functions) *= data.factor[first + i];
      if (form.has_offset) rows(functions, i) = 1;
    }
    double xx = gram(0, 0), xy = gram(0, 1), xz = gram(0, 2), yy = gram(1, 1), yz = gram(1, 2),
           zz = gram(2, 2);
    double bx = b[0], by = b[1], bz = b[2];
    for (Eigen::Index i = 0; i < count; ++i) {
      const double x = rows(0, i), y = rows(1, i), z = rows(2, i), target = data.target[first + i];
      xx += x * x;
      xy += x * y;
      xz += x * z;
      yy += y * y;
      yz += y * z;
      zz += z * z;
      bx += target * x;
      by += target * y;
      bz += target * z;
      squares += target * target;
    }
    gram << xx, xy, xz, xy, yy, yz, xz, yz, zz;
    b << bx, by, bz;
  }
  FormFit fit;
  fit.theta = theta;
  const double n = std::max<double>(static_cast<double>(data.target.size()), 1);
  Eigen::MatrixXd held = gram.topLeftCorner(size, size);
  for (Eigen::Index k = 0; k < size; ++k) held(k, k) += 1e-9 * held(k, k) + 1e-12 * n;
  fit.coefficients = held.ldlt().solve(b.head(size));
  const double left = squares - 2 * fit.coefficients.dot(b.head(size)) +
                      fit.coefficients.dot(gram.topLeftCorner(size, size) * fit.coefficients);
  fit.mean_square = std::isfinite(left) ? std::max(left, 0.0) / n : kInfinity;
  return fit;
}

FormFit fit_form(const Form& form, const FormData& data, const std::vector<double>& start) {
  FormFit best;
  best.mean_square = kInfinity;
  for (const std::vector<double>& theta :
       start.empty() ? best_starts(form, data) : std::vector<std::vector<double>>{start}) {
    FormFit fit = fit_coefficients(form, data, theta);
    if (fit.mean_square < best.mean_square) best = std::move(fit);
  }
  if (!std::isfinite(best.mean_square)) return best;
  return improved(form, data, std::move(best));
}

double value_of(const Form& form, const FormFit& fit, const double* inputs, double factor) {
  std::array<double, 2> functions{};
  form.values(inputs, fit.theta.data(), functions.data());
  double sum = form.has_offset ? fit.coefficients[fit.coefficients.size() - 1] : 0;
  for (std::size_t k = 0; k < form.texts.size(); ++k)
    sum += factor * fit.coefficients[static_cast<Eigen::Index>(k)] * functions[k];
  return sum;
}

}  // namespace swarmcert::identification
