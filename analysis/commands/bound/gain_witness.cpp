#include "analysis/commands/bound/gain_witness.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <stdexcept>

#include "stability/bounds/loops/polynomial.h"

namespace swarmcert::analysis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using stability::Polynomial;

constexpr double kMostSteps = 1 << 18;
constexpr const char* kTooFarAbove =
    "the bounds that the checker can verify are more than 5 % above the enclosure";

/// The characteristic polynomial, without the factor s present for Ki = 0; a delay is replaced by its expansion.
Polynomial characteristic(const stability::AxisLoop& loop, const std::vector<double>& lags_s,
                          int delay_order) {
  Polynomial open = {1};
  for (const double tau : lags_s) open = stability::product(open, {1, tau});
  const bool integrates = loop.Ki > 0;
  const Polynomial feedback =
      integrates ? Polynomial{loop.Ki, loop.Kp, loop.Kd} : Polynomial{loop.Kp, loop.Kd};
  Polynomial expansion = {1};
  for (int j = 1; j <= delay_order; ++j) expansion.push_back(-expansion.back() * loop.delay_s / j);
  return stability::sum(stability::times_s_to(integrates ? 3 : 2, open),
                        stability::product(feedback, expansion));
}

/// The companion matrix of `p` with time in units of 2^-exponent s.
MatrixXd companion(const Polynomial& p, int exponent) {
  const auto n = static_cast<Index>(p.size()) - 1;
  MatrixXd A = MatrixXd::Zero(n, n);
  for (Index k = 0; k + 1 < n; ++k) A(k, k + 1) = 1;
  for (Index k = 0; k < n; ++k) {
    A(n - 1, k) = -std::ldexp(p[static_cast<std::size_t>(k)] / p.back(), -exponent * static_cast<int>(n - k));
  }
  return A;
}

/// Solves A'P + PA = -I for P, with A shifted to the right by `shift`.
MatrixXd lyapunov(const MatrixXd& A, double shift) {
  const Index n = A.rows();
  const MatrixXd shifted = A + shift * MatrixXd::Identity(n, n);
  MatrixXd system = MatrixXd::Zero(n * n, n * n);
  VectorXd right = VectorXd::Zero(n * n);
  for (Index i = 0; i < n; ++i) {
    right[i * n + i] = -1;
    for (Index j = 0; j < n; ++j) {
      for (Index k = 0; k < n; ++k) {
        system(i * n + j, k * n + j) += shifted(k, i);
        system(i * n + j, i * n + k) += shifted(k, j);
      }
    }
  }
  const VectorXd solution = system.fullPivLu().solve(right);
  MatrixXd P(n, n);
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j < n; ++j) P(i, j) = (solution[i * n + j] + solution[j * n + i]) / 2;
  }
  return P;
}

/// Scales P so that its largest entry is about 2^20 and rounds all entries to multiples of 2^-60.
std::vector<std::vector<double>> in_fixed_point(const MatrixXd& P) {
  const int exponent = 20 - std::ilogb(P.cwiseAbs().maxCoeff());
  std::vector<std::vector<double>> rows;
  for (Index i = 0; i < P.rows(); ++i) {
    rows.emplace_back();
    for (Index j = 0; j < P.cols(); ++j)
      rows.back().push_back(std::ldexp(std::round(std::ldexp(P(i, j), exponent + 60)), -60));
  }
  return rows;
}

/// The largest ratio of a bound to the upper end of its known enclosure.
double excess(const check::GainBounds& bounds, const stability::VerifiedNorms& known) {
  double most =
      std::max({bounds.amplitude.get_d() / known.amplitude.upper, bounds.edge.get_d() / known.edge.upper,
                bounds.impulse.get_d() / known.impulse.upper});
  if (bounds.rate) most = std::max(most, bounds.rate->get_d() / known.rate.upper);
  return most;
}

void set_numbers(const stability::AxisLoop& loop, check::LoopNumbers& numbers) {
  numbers.mass_kg = loop.mass_kg;
  numbers.Kp = loop.Kp, numbers.Kd = loop.Kd, numbers.Ki = loop.Ki;
  numbers.delay_s = loop.delay_s;
  std::copy_if(loop.lags_s.begin(), loop.lags_s.end(), std::back_inserter(numbers.lags_s),
               [](double tau) { return tau > 0; });
}

std::optional<ProvedGains> search_witness(const stability::AxisLoop& loop, const std::string& input,
                                          int delay_order, const stability::VerifiedNorms& known,
                                          std::string& why) {
  ProvedGains found;
  check::LoopWitness& witness = found.witness;
  witness.input = input;
  witness.delay_order = delay_order;
  set_numbers(loop, witness);
  const Polynomial p = characteristic(loop, witness.lags_s, delay_order);
  double slowest = 1e300, fastest = 0;
  for (const std::complex<double>& pole : stability::poles(p)) {
    slowest = std::min(slowest, -pole.real());
    fastest = std::max(fastest, std::abs(pole));
  }
  why = "no witness was found";
  if (!(slowest > 0)) return std::nullopt;
  witness.time_exponent = static_cast<int>(std::lround(std::log2(fastest)));
  const MatrixXd A = companion(p, witness.time_exponent);
  const double slow = std::ldexp(slowest, -witness.time_exponent);
  witness.step_exponent = std::max(
      4, 1 + static_cast<int>(std::ceil(std::log2(A.cwiseAbs().rowwise().sum().maxCoeff() * (1 + 1e-9)))));
  for (const double share : {0.8, 0.5, 0.2}) {
    witness.P = in_fixed_point(lyapunov(A, share * slow));
    witness.decay = 0.9 * share * slow;
    double steps = std::ldexp(std::log(1e3) / slow, witness.step_exponent);
    try {
      for (int round = 0; round < 4; ++round, steps *= 1.7) {
        witness.steps = static_cast<long>(std::clamp(std::ceil(steps), 1.0, kMostSteps));
        found.bounds = check::upper_gains(witness);
        if (excess(found.bounds, known) < 1.01) return found;
      }
      if (excess(found.bounds, known) < 1.05) return found;
      why = kTooFarAbove;
    } catch (const std::runtime_error& refusal) {
      why = std::string("no witness was found: ") + refusal.what();
    }
  }
  return std::nullopt;
}

/// The spectral radius of M.
double radius_of(const MatrixXd& M) {
  return Eigen::EigenSolver<MatrixXd>(M, false).eigenvalues().cwiseAbs().maxCoeff();
}

/// Solves P - (M/factor) P (M/factor)' = I for P, in units that balance the states: w^k for the k-th derivative of e.
MatrixXd contracted_form(const check::SampledWitness& loop, const MatrixXd& M, double factor) {
  const Index n = M.rows();
  const double w = std::sqrt(loop.Kp);
  VectorXd unit = VectorXd::Constant(n, 1 / (w * w));
  unit[0] = 1;
  unit[1] = 1 / w;
  if (loop.Ki > 0) unit[2 + static_cast<Index>(loop.lags_s.size())] = w;
  const VectorXd back = unit.cwiseInverse();
  MatrixXd power = unit.asDiagonal() * M * back.asDiagonal();
  power /= factor;
  MatrixXd P = MatrixXd::Identity(n, n);
  for (int i = 0; i < 60 && power.norm() > 1e-12; ++i) {
    P += (power * P * power.transpose()).eval();
    power = (power * power).eval();
  }
  P = (back.asDiagonal() * P * back.asDiagonal()).eval();
  return (P + P.transpose()) / 2;
}

double excess(const check::SampledGainBounds& bounds, const SampledEnclosures& known) {
  return std::max({excess(bounds.force, known.force), excess(bounds.command, known.command),
                   excess(bounds.velocity, known.velocity), excess(bounds.position, known.position)});
}

std::optional<ProvedSampledGains> search_sampled(const stability::SampledLoop& loop,
                                                 const SampledEnclosures& known, std::string& why) {
  ProvedSampledGains found;
  check::SampledWitness& witness = found.witness;
  set_numbers(loop.plant, witness);
  witness.period_s = loop.period_s, witness.integrator_step_s = loop.integrator_step_s;
  const std::vector<std::vector<double>> map = check::period_map(witness);
  const auto n = static_cast<Index>(map.size());
  MatrixXd M(n, n);
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j < n; ++j) M(i, j) = map[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
  }
  const double gap = 1 - radius_of(M);
  why = "no witness was found";
  if (!(gap > 0)) return std::nullopt;
  for (const double share : {0.8, 0.5, 0.2}) {
    witness.P = in_fixed_point(contracted_form(witness, M, 1 - share * gap));
    witness.contraction = 1 - 0.9 * share * gap;
    for (const double reduction : {1e5, 1e9}) {
      witness.steps = static_cast<long>(std::clamp(std::log(reduction) / gap, 1.0, kMostSteps));
      try {
        found.bounds = check::sampled_upper_gains(witness);
      } catch (const std::runtime_error& refusal) {
        why = std::string("no witness was found: ") + refusal.what();
        break;
      }
      if (excess(found.bounds, known) < 1.05) return found;
      why = kTooFarAbove;
    }
  }
  return std::nullopt;
}

}  // namespace

std::optional<ProvedGains> gain_witness(const stability::AxisLoop& loop, const std::string& input,
                                        const stability::VerifiedNorms& known, std::string& why) {
  const auto lags = std::count_if(loop.lags_s.begin(), loop.lags_s.end(), [](double tau) { return tau > 0; });
  for (int delay_order = loop.delay_s > 0 ? static_cast<int>(lags) : 0; delay_order >= 0; --delay_order) {
    if (auto found = search_witness(loop, input, delay_order, known, why)) return found;
  }
  return std::nullopt;
}

std::optional<ProvedSampledGains> sampled_gain_witness(const stability::SampledLoop& loop,
                                                       const SampledEnclosures& known, std::string& why) {
  try {
    return search_sampled(loop, known, why);
  } catch (const std::runtime_error& refusal) {  // for numbers that the checker does not accept
    why = std::string("no witness was found: ") + refusal.what();
    return std::nullopt;
  }
}

}  // namespace swarmcert::analysis
