#include "analysis/identification/rotors/rotor_balance.h"

#include <fmt/core.h>

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>

namespace swarmcert::identification {
namespace {

constexpr int kRotors = 4;
const char* const kPlaces[kRotors] = {"front right", "back right", "back left", "front left"};

Eigen::Vector4d mean_of(const std::vector<RotorLoads>& flights) {
  Eigen::Vector4d mean = Eigen::Vector4d::Zero();
  for (const RotorLoads& flight : flights) mean += flight.mean_N / static_cast<double>(flights.size());
  return mean;
}

Eigen::Vector4d over_the_lowest_two(const Eigen::Vector4d& rise) {
  std::array<double, kRotors> sorted;
  std::copy(rise.data(), rise.data() + kRotors, sorted.begin());
  std::sort(sorted.begin(), sorted.end());
  return rise.array() - (sorted[0] + sorted[1]) / 2;
}

/// Variance of one load between healthy flights, without what is common to all four rotors.
struct Scatter {
  double variance_N2 = 0;
  double freedom = 1;
};

Scatter scatter_of(const std::vector<RotorLoads>& healthy, double least_rise_N) {
  const auto count = static_cast<double>(healthy.size());
  // A single flight does not show how flights differ; the effect of the battery's position is used instead.
  if (healthy.size() < 2) return {std::pow(least_rise_N / 2, 2), kRotors - 1};
  const Eigen::Vector4d mean = mean_of(healthy);
  double squares = 0, errors = 0;
  for (const RotorLoads& flight : healthy) {
    const Eigen::Vector4d off = flight.mean_N - mean;
    squares += (off.array() - off.mean()).square().sum();
    errors += flight.error_N.squaredNorm() / (kRotors * count);
  }
  const double freedom = (kRotors - 1) * (count - 1);
  return {std::max(squares / freedom, errors), freedom};
}

void fill_factors(const Scatter& scatter, double flights, RotorBalance& balance) {
  // A rise is a load minus the mean of two others.
  const double healthy = 1.0 / balance.healthy_flights;
  const double error_N = std::sqrt(1.5 * scatter.variance_N2 * (1 / flights + healthy));
  const double half_N = error_N * boost::math::quantile(boost::math::students_t(scatter.freedom), 0.95);
  for (int k = 0; k < kRotors; ++k) {
    RotorFactor& factor = balance.factors[static_cast<std::size_t>(k)];
    const auto of = [&](double rise_N) { return std::max(1 - rise_N / balance.load_N[k], 0.0); };
    factor.value = of(balance.rise_N[k]);
    factor.interval = {of(balance.rise_N[k] + half_N), of(balance.rise_N[k] - half_N)};
  }
}

}  // namespace

RotorBalance rotor_balance(const std::vector<RotorLoads>& own, const std::vector<RotorLoads>& healthy,
                           const stability::Model& model) {
  RotorBalance balance;
  balance.vehicle = own.front().vehicle;
  if (own.size() == 1) balance.flight = own.front().flight;
  balance.flights = static_cast<int>(own.size());
  balance.healthy_flights = static_cast<int>(healthy.size());
  for (const RotorLoads& flight : own) balance.records += flight.records;
  balance.load_N = mean_of(own);
  balance.healthy_N = mean_of(healthy);
  balance.rise_N = over_the_lowest_two(balance.load_N - balance.healthy_N);
  const double lever_m = model.arm_m * std::sqrt(0.5);
  const double alone_N = 2 * kBatteryPlay_m / lever_m * balance.load_N.mean();
  // The battery position varies in the healthy flights as well.
  balance.least_rise_N = alone_N * std::sqrt(1 + 1.0 / balance.healthy_flights);
  fill_factors(scatter_of(healthy, alone_N), balance.flights, balance);
  Eigen::Index first = 0;
  const double largest_N = balance.rise_N.maxCoeff(&first);
  double second_N = 0;
  for (Eigen::Index k = 0; k < kRotors; ++k) {
    if (k != first) second_N = std::max(second_N, balance.rise_N[k]);
  }
  const bool stands_out = balance.factors[static_cast<std::size_t>(first)].interval.upper < 1;
  if (largest_N > balance.least_rise_N && second_N <= kMostOfSecond * largest_N && stands_out)
    balance.rotor = static_cast<int>(first) + 1;
  return balance;
}

std::vector<RotorBalance> rotor_balances(const std::vector<RotorLoads>& own,
                                         const std::vector<RotorLoads>& healthy,
                                         const stability::Model& model) {
  const auto of_vehicle = [](const std::vector<RotorLoads>& all, const std::string& vehicle) {
    std::vector<RotorLoads> some;
    for (const RotorLoads& loads : all) {
      if (loads.vehicle == vehicle) some.push_back(loads);
    }
    return some;
  };
  std::vector<std::string> vehicles;
  for (const RotorLoads& loads : own) vehicles.push_back(loads.vehicle);
  std::sort(vehicles.begin(), vehicles.end());
  vehicles.erase(std::unique(vehicles.begin(), vehicles.end()), vehicles.end());
  std::vector<RotorBalance> balances;
  for (const std::string& vehicle : vehicles) {
    const std::vector<RotorLoads> before = of_vehicle(healthy, vehicle), now = of_vehicle(own, vehicle);
    if (before.empty()) continue;
    balances.push_back(rotor_balance(now, before, model));
    balances.back().flight.clear();
    for (const RotorLoads& flight : now) balances.push_back(rotor_balance({flight}, before, model));
  }
  return balances;
}

std::string in_words(const RotorBalance& balance) {
  if (balance.rotor == 0) return "no rotor stands out";
  const auto k = static_cast<std::size_t>(balance.rotor - 1);
  const RotorFactor& factor = balance.factors[k];
  return fmt::format(
      "rotor {} ({}) is weak, or carries a load near it: {:.0f} % less thrust than in healthy flight (90 %: "
      "{:.0f} .. {:.0f} %)",
      balance.rotor, kPlaces[k], 100 * (1 - factor.value), 100 * (1 - factor.interval.upper),
      100 * (1 - factor.interval.lower));
}

}  // namespace swarmcert::identification
