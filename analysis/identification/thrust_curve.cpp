#include "analysis/identification/thrust_curve.h"

#include <fmt/core.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "stability/model.h"

namespace swarmcert::identification {
namespace {

constexpr double kLoadBlock_s = 0.2, kLeftOutOfFlight_s = 2, kLeastUpright = 0.7;
constexpr double kLeastExplainedLoad = 0.9, kLeastFallOfCurve = 0.01;
constexpr std::size_t kFewestLoadBlocks = 50, kPartsOfFlight = 5;

/// The powers of the command that a polynomial has.
using Terms = std::vector<Eigen::Index>;

/// The blocks as a linear system.
struct LoadSystem {
  Eigen::MatrixX3d powers;
  Eigen::VectorXd load;
};

LoadSystem joined_blocks(const std::vector<LoadBlocks>& parts, std::size_t without) {
  LoadSystem all;
  Eigen::Index rows = 0;
  for (std::size_t f = 0; f < parts.size(); ++f)
    rows += f == without ? 0 : static_cast<Eigen::Index>(parts[f].load.size());
  all.powers.resize(rows, 3);
  all.load.resize(rows);
  Eigen::Index row = 0;
  for (std::size_t f = 0; f < parts.size(); ++f) {
    if (f == without) continue;
    for (std::size_t i = 0; i < parts[f].load.size(); ++i, ++row) {
      all.powers.row(row) = parts[f].powers[i].transpose();
      all.load[row] = parts[f].load[i];
    }
  }
  return all;
}

/// Returns the least-squares coefficients of all powers; those that are not among `terms` are zero.
Eigen::Vector3d fitted_shares(const LoadSystem& system, const Terms& terms) {
  Eigen::MatrixXd columns(system.load.size(), static_cast<Eigen::Index>(terms.size()));
  for (std::size_t k = 0; k < terms.size(); ++k)
    columns.col(static_cast<Eigen::Index>(k)) = system.powers.col(terms[k]);
  const Eigen::VectorXd c = columns.colPivHouseholderQr().solve(system.load);
  Eigen::Vector3d all = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < terms.size(); ++k) all[terms[k]] = c[static_cast<Eigen::Index>(k)];
  return all;
}

double load_rms(const LoadBlocks& blocks, const Eigen::Vector3d& shares) {
  double squares = 0;
  for (std::size_t i = 0; i < blocks.load.size(); ++i)
    squares += std::pow(blocks.load[i] - shares.dot(blocks.powers[i]), 2);
  return std::sqrt(squares / static_cast<double>(blocks.load.size()));
}

/// Returns the fifths of a flight.
std::vector<LoadBlocks> fifths_of(const LoadBlocks& flight) {
  const std::size_t count = flight.load.size();
  std::vector<LoadBlocks> parts(kPartsOfFlight);
  for (std::size_t i = 0; i < count; ++i) {
    LoadBlocks& part = parts[i * kPartsOfFlight / count];
    part.powers.push_back(flight.powers[i]);
    part.load.push_back(flight.load[i]);
  }
  return parts;
}

/// Returns the errors of each fifth of each flight, of a polynomial fitted to the other flights; of a single flight, to
/// its other fifths.
std::vector<double> held_out_errors(const std::vector<LoadBlocks>& flights, const Terms& terms) {
  std::vector<double> errors;
  for (std::size_t f = 0; f < flights.size(); ++f) {
    const std::vector<LoadBlocks> parts = fifths_of(flights[f]);
    for (std::size_t k = 0; k < parts.size(); ++k) {
      const LoadSystem others = flights.size() > 1 ? joined_blocks(flights, f) : joined_blocks(parts, k);
      errors.push_back(load_rms(parts[k], fitted_shares(others, terms)));
    }
  }
  return errors;
}

/// The mean of ratios of errors, and its standard error.
struct ErrorRatio {
  double mean = 0, deviation = 0;
  bool is_below(double least) const { return mean <= least && mean + 2 * deviation <= 1; }
};

ErrorRatio error_ratio(const std::vector<double>& errors, const std::vector<double>& reference) {
  const auto count = static_cast<double>(errors.size());
  ErrorRatio ratio;
  double squares = 0;
  for (std::size_t k = 0; k < errors.size(); ++k) ratio.mean += errors[k] / reference[k] / count;
  for (std::size_t k = 0; k < errors.size(); ++k)
    squares += std::pow(errors[k] / reference[k] - ratio.mean, 2);
  ratio.deviation = std::sqrt(squares / (count * (count - 1)));
  return ratio;
}

/// Whether a + b u + c u^2 is not negative from the command `least` on, and grows from rest to the full command, as
/// model files require.
bool grows(const Eigen::Vector3d& shares, double least) {
  const bool is_push = shares.dot(Eigen::Vector3d(1, least, least * least)) >= 0;
  return is_push && shares[1] > 0 && shares[1] + 2 * shares[2] > 0;
}

}  // namespace

LoadBlocks load_blocks(const logs::Log& log, const std::vector<char>& is_airborne) {
  LoadBlocks blocks;
  const int motors = log.signals.motor_commands;
  const double begin_s = 1e-6 * log.samples.front().time_us + kLeftOutOfFlight_s,
               end_s = 1e-6 * log.samples.back().time_us - kLeftOutOfFlight_s;
  Eigen::Vector3d powers = Eigen::Vector3d::Zero();
  double load = 0, count = 0, start_s = begin_s;
  for (std::size_t i = 0; i < log.samples.size(); ++i) {
    const logs::Sample& s = log.samples[i];
    const double now_s = 1e-6 * s.time_us, up = s.attitude.rotation()[2][2];
    if (is_airborne[i] == 0 || up < kLeastUpright || now_s < begin_s || now_s > end_s) continue;
    if (now_s - start_s > kLoadBlock_s) {
      if (count > 0) {
        blocks.powers.emplace_back(powers / count);
        blocks.load.push_back(load / count);
      }
      powers.setZero();
      load = count = 0;
      start_s = now_s;
    }
    for (int k = 0; k < motors; ++k) {
      const double u = s.motor_command[static_cast<std::size_t>(k)];
      powers += Eigen::Vector3d(1, u, u * u) / motors;
    }
    load += s.specific_force_m_s2[2] / up / stability::kGravity_m_s2;
    ++count;
  }
  return blocks;
}

ThrustCurve thrust_curve(const std::vector<LoadBlocks>& flights, int power) {
  ThrustCurve curve;
  std::vector<LoadBlocks> usable;
  for (const LoadBlocks& flight : flights) {
    if (flight.load.size() >= kFewestLoadBlocks) usable.push_back(flight);
  }
  if (usable.empty()) return {curve.shares, "too little flight for more terms"};
  const LoadSystem all = joined_blocks(usable, usable.size());
  const Terms plain = {power};
  const Eigen::VectorXd off = all.load.array() - all.load.mean();
  const double left = (all.load - all.powers * fitted_shares(all, plain)).squaredNorm();
  const double explained = 1 - left / std::max(off.squaredNorm(), 1e-12);
  if (explained < kLeastExplainedLoad) {
    curve.why = fmt::format("it explains {:.0f} % of how the load varies, too little to tell more terms",
                            100 * std::max(explained, 0.0));
    return curve;
  }
  const std::vector<double> reference = held_out_errors(usable, plain);
  double best = 1 - kLeastFallOfCurve;
  for (const Terms& terms : {Terms{1, 2}, Terms{0, 1, 2}}) {
    const ErrorRatio ratio = error_ratio(held_out_errors(usable, terms), reference);
    curve.why += fmt::format("{}{} terms: held-out error {:+.1f} % (+-{:.1f})", curve.why.empty() ? "" : ", ",
                             terms.size(), 100 * (ratio.mean - 1), 100 * ratio.deviation);
    const Eigen::Vector3d shares = fitted_shares(all, terms);
    if (!ratio.is_below(best) || !grows(shares, all.powers.col(1).minCoeff())) continue;
    best = ratio.mean - kLeastFallOfCurve;
    curve.shares = shares;
  }
  return curve;
}

}  // namespace swarmcert::identification
