#include "analysis/tracking/peak_model.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <stdexcept>

namespace swarmcert::analysis {
namespace {

/// Transition of the Huber loss: beyond this |log(predicted/peak)| the influence of a flight is constant.
constexpr double kHuberLog = 0.3;
constexpr int kFitRounds = 30;
constexpr int kFolds = 5;
constexpr double kLeastPeak_m = 1e-6;

Eigen::Index at(std::size_t i) { return static_cast<Eigen::Index>(i); }

/// Solves the least-squares problem in the free coordinates; the others are zero.
Eigen::VectorXd free_solution(const Eigen::MatrixXd& G, const Eigen::VectorXd& f,
                              const std::vector<bool>& is_free) {
  std::vector<Eigen::Index> index;
  for (std::size_t k = 0; k < is_free.size(); ++k)
    if (is_free[k]) index.push_back(at(k));
  Eigen::MatrixXd part(at(index.size()), at(index.size()));
  Eigen::VectorXd right(at(index.size()));
  for (std::size_t i = 0; i < index.size(); ++i) {
    right[at(i)] = f[index[i]];
    for (std::size_t j = 0; j < index.size(); ++j) part(at(i), at(j)) = G(index[i], index[j]);
  }
  Eigen::VectorXd result = Eigen::VectorXd::Zero(f.size());
  // Parts can be multiples of each other; the minimum-norm solution then shares the weight between them.
  const Eigen::VectorXd solution = part.completeOrthogonalDecomposition().solve(right);
  for (std::size_t i = 0; i < index.size(); ++i) result[index[i]] = solution[at(i)];
  return result;
}

std::vector<double> largest_finite(const std::vector<FlownPeak>& flights) {
  std::vector<double> largest(flights.empty() ? 0 : flights.front().parts.size(), 0.0);
  for (const FlownPeak& flight : flights) {
    for (std::size_t k = 0; k < largest.size(); ++k)
      if (std::isfinite(flight.parts[k])) largest[k] = std::max(largest[k], flight.parts[k]);
  }
  return largest;
}

/// A loop that the model calls unstable was flown nevertheless: it counts as the worst of the stable loops.
double finite_part(double part, double largest) { return std::isfinite(part) ? part : largest; }

double prediction_m(const FlownPeak& flight, const std::vector<double>& weights,
                    const std::vector<double>& largest) {
  double total_m = flight.known_m;
  for (std::size_t k = 0; k < weights.size(); ++k)
    total_m += weights[k] * finite_part(flight.parts[k], largest[k]);
  return std::max(total_m, kLeastPeak_m);
}

}  // namespace

Eigen::VectorXd nonnegative_least_squares(const Eigen::MatrixXd& G, const Eigen::VectorXd& f) {
  const Eigen::Index n = f.size();
  Eigen::VectorXd x = Eigen::VectorXd::Zero(n);
  std::vector<bool> is_free(static_cast<std::size_t>(n), false);
  const double tolerance = 1e-10 * std::max(1e-300, f.cwiseAbs().maxCoeff());
  for (int round = 0; round < 10 * static_cast<int>(n); ++round) {
    const Eigen::VectorXd slope = f - G * x;
    Eigen::Index best = -1;
    for (Eigen::Index k = 0; k < n; ++k) {
      if (is_free[static_cast<std::size_t>(k)] || slope[k] <= tolerance) continue;
      if (best < 0 || slope[k] > slope[best]) best = k;
    }
    if (best < 0) break;
    is_free[static_cast<std::size_t>(best)] = true;
    for (;;) {
      const Eigen::VectorXd trial = free_solution(G, f, is_free);
      double step = 1;
      for (Eigen::Index k = 0; k < n; ++k) {
        if (!is_free[static_cast<std::size_t>(k)] || trial[k] > 0) continue;
        step = std::min(step, x[k] / std::max(x[k] - trial[k], 1e-300));
      }
      x += step * (trial - x);
      if (step == 1) break;
      bool removed = false;
      for (Eigen::Index k = 0; k < n; ++k) {
        if (!is_free[static_cast<std::size_t>(k)] || x[k] > 1e-14 || trial[k] > 0) continue;
        x[k] = 0;
        is_free[static_cast<std::size_t>(k)] = false;
        removed = true;
      }
      if (!removed) break;
    }
  }
  return x.cwiseMax(0.0);
}

double PeakModel::predicted_m(const FlownPeak& flight) const {
  return prediction_m(flight, weights, largest);
}

bool PeakModel::extrapolates(const FlownPeak& flight) const {
  for (std::size_t k = 0; k < weights.size(); ++k)
    if (weights[k] > 0 && flight.parts[k] > largest[k]) return true;
  return false;
}

std::vector<double> fit_peak_weights(const std::vector<FlownPeak>& flights,
                                     const std::vector<double>& largest) {
  const std::size_t n = largest.size();
  Eigen::MatrixXd parts(at(flights.size()), at(n));
  Eigen::VectorXd peaks(at(flights.size())), known(at(flights.size()));
  for (std::size_t i = 0; i < flights.size(); ++i) {
    peaks[at(i)] = std::max(flights[i].peak_m, kLeastPeak_m);
    known[at(i)] = flights[i].known_m;
    for (std::size_t k = 0; k < n; ++k)
      parts(at(i), at(k)) = largest[k] > 0 ? finite_part(flights[i].parts[k], largest[k]) / largest[k] : 0;
  }
  const std::vector<double> shares = group_weights(flights);
  Eigen::VectorXd predicted = peaks, scaled = Eigen::VectorXd::Zero(at(n));
  for (int round = 0; round < kFitRounds; ++round) {
    // Linearises log(predicted) about the present prediction p: log(p) + (predicted - p)/p. The residual is relative
    // to p.
    Eigen::VectorXd weight(predicted.size()), target(predicted.size());
    for (Eigen::Index i = 0; i < predicted.size(); ++i) {
      const double residual = std::log(predicted[i] / peaks[i]);
      const double huber = std::min(1.0, kHuberLog / std::max(std::abs(residual), 1e-9));
      weight[i] = shares[static_cast<std::size_t>(i)] * huber / (predicted[i] * predicted[i]);
      target[i] = predicted[i] * (1 - residual) - known[i];
    }
    const Eigen::MatrixXd weighted = weight.asDiagonal() * parts;
    scaled = nonnegative_least_squares(parts.transpose() * weighted, weighted.transpose() * target);
    const Eigen::VectorXd next = (parts * scaled + known).cwiseMax(kLeastPeak_m);
    predicted = (predicted + next) / 2;
  }
  std::vector<double> weights;
  for (std::size_t k = 0; k < n; ++k) weights.push_back(largest[k] > 0 ? scaled[at(k)] / largest[k] : 0);
  return weights;
}

PeakModel calibrate_peaks(const std::vector<FlownPeak>& flights, double level) {
  std::set<std::string> names;
  for (const FlownPeak& flight : flights) names.insert(flight.group);
  if (static_cast<int>(names.size()) < std::max(fewest_groups(level), kFolds))
    throw std::invalid_argument("calibrate_peaks: too few groups for this level");
  std::map<std::string, int> fold_of;
  int next = 0;
  for (const std::string& name : names) fold_of[name] = next++ % kFolds;
  std::vector<FlightScore> scores;
  for (int fold = 0; fold < kFolds; ++fold) {
    std::vector<FlownPeak> others;
    for (const FlownPeak& flight : flights)
      if (fold_of[flight.group] != fold) others.push_back(flight);
    const std::vector<double> largest = largest_finite(others);
    const std::vector<double> weights = fit_peak_weights(others, largest);
    for (const FlownPeak& flight : flights) {
      if (fold_of[flight.group] == fold)
        scores.push_back({flight.group, flight.peak_m / prediction_m(flight, weights, largest)});
    }
  }
  PeakModel model;
  model.largest = largest_finite(flights);
  model.weights = fit_peak_weights(flights, model.largest);
  model.promise = conformal_threshold(scores, level);
  return model;
}

}  // namespace swarmcert::analysis
