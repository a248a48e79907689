// Impulse responses without a delay: the state is (y, y', ..., y^(n-1)), so the zeros of y and of its derivatives are
// zeros of its coordinates, and the antiderivative that vanishes at infinity is a fixed linear combination of them.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "stability/bounds/loops/impulse_response.h"
#include "stability/bounds/loops/response_pieces.h"
#include "stability/bounds/loops/zero_scan.h"

namespace swarmcert::stability {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Modes that have decayed to exp(-kGone) are ignored from then on.
constexpr double kGone = 60;
/// Longest segment, in radians of the fastest remaining mode.
constexpr double kResponseStretch = 0.25;
constexpr int kResponseTaylorTerms = 20;

/// Uses time units of 1/rate, with rate the largest modulus of a pole, so that all entries are of moderate size.
class Chain {
 public:
  explicit Chain(const TransferFunction& y) {
    const std::size_t n = y.denominator.size() - 1;
    for (const std::complex<double>& pole : poles(y.denominator)) {
      rate_ = std::max(rate_, std::abs(pole));
      poles_.push_back(pole);
    }
    if (rate_ == 0) rate_ = 1;
    std::sort(poles_.begin(), poles_.end(),
              [](const auto& a, const auto& b) { return std::abs(a) < std::abs(b); });
    // Denominator in scaled time, monic: y^(n) = -sum a_k y^(k), with y^(k) in units of rate^k.
    a_.resize(static_cast<Eigen::Index>(n));
    for (std::size_t k = 0; k < n; ++k) {
      a_[static_cast<Eigen::Index>(k)] =
          y.denominator[k] / y.denominator[n] / std::pow(rate_, static_cast<double>(n - k));
    }
    // Markov parameters: y^(k)(0+) = c_{k+1} of numerator/denominator = sum c_j s^-j.
    initial_ = VectorXd::Zero(static_cast<Eigen::Index>(n));
    for (std::size_t k = 0; k < n; ++k) {
      const std::size_t power = n - 1 - k;
      double c = power < y.numerator.size()
                     ? y.numerator[power] / y.denominator[n] / std::pow(rate_, static_cast<double>(k))
                     : 0;
      for (std::size_t j = 0; j < k; ++j) {
        c -= a_[static_cast<Eigen::Index>(n - k + j)] * initial_[static_cast<Eigen::Index>(j)];
      }
      initial_[static_cast<Eigen::Index>(k)] = c;
    }
  }

  double rate() const { return rate_; }
  const VectorXd& initial() const { return initial_; }
  const std::vector<std::complex<double>>& sorted_poles() const { return poles_; }

  /// Returns int y over scaled time, the antiderivative that vanishes at infinity.
  double integral(const VectorXd& x) const {
    const Eigen::Index n = a_.size();
    double total = x[n - 1];
    for (Eigen::Index k = 1; k < n; ++k) total += a_[k] * x[k - 1];
    return -total / a_[0];
  }

  /// Returns the Taylor polynomial of y from state x; terms beyond the state follow from the differential equation.
  Polynomial taylor(const VectorXd& x, int terms) const {
    const auto n = static_cast<std::size_t>(a_.size());
    Polynomial derivatives(static_cast<std::size_t>(terms));
    for (std::size_t k = 0; k < derivatives.size(); ++k) {
      if (k < n) {
        derivatives[k] = x[static_cast<Eigen::Index>(k)];
        continue;
      }
      double next = 0;
      for (std::size_t j = 0; j < n; ++j) next -= a_[static_cast<Eigen::Index>(j)] * derivatives[k - n + j];
      derivatives[k] = next;
    }
    double factorial = 1;
    for (std::size_t k = 1; k < derivatives.size(); ++k) {
      factorial *= static_cast<double>(k);
      derivatives[k] /= factorial;
    }
    return derivatives;
  }

  /// (y, y', y'', y''').
  void first_four(const VectorXd& x, double* out) const {
    const Eigen::Index n = a_.size();
    for (Eigen::Index k = 0; k < 4 && k < n; ++k) out[k] = x[k];
    for (Eigen::Index k = n; k < 4; ++k) {
      out[k] = 0;
      for (Eigen::Index j = 0; j < n; ++j) out[k] -= a_[j] * out[k - n + j];
    }
  }

  /// Returns exp(companion * duration) by Taylor series, for a duration of at most about one.
  MatrixXd propagator(double duration) const {
    const Eigen::Index n = a_.size();
    MatrixXd companion = MatrixXd::Zero(n, n);
    for (Eigen::Index k = 0; k + 1 < n; ++k) companion(k, k + 1) = 1;
    companion.row(n - 1) = -a_.transpose();
    constexpr int kHalvings = 3;  // |companion| is up to 2^n
    companion *= std::ldexp(duration, -kHalvings);
    MatrixXd result = MatrixXd::Identity(n, n);
    MatrixXd term = result;
    for (int k = 1; k < kResponseTaylorTerms + 6; ++k) {
      term = term * companion / k;
      result += term;
    }
    for (int k = 0; k < kHalvings; ++k) result = (result * result).eval();
    return result;
  }

 private:
  double rate_ = 0;
  std::vector<std::complex<double>> poles_;
  VectorXd a_;
  VectorXd initial_;
};

/// Traverses the response in segments whose length doubles as fast modes decay, halving them where sign changes occur.
class Scan {
 public:
  explicit Scan(const Chain& chain)
      : chain_(chain),
        zeros_(chain.integral(chain.initial()), chain.initial()[0], slope_at(chain.initial())) {}

  ResponseNorms run() {
    double slowest = 1e300;
    for (const std::complex<double>& pole : chain_.sorted_poles()) {
      slowest = std::min(slowest, -pole.real() / chain_.rate());
    }
    ladder_.push_back(chain_.propagator(kResponseStretch));
    VectorXd x = chain_.initial();
    double t = 0;
    long events_before_alone = -1;
    while (slowest * t < kGone && !is_lone_decay(t)) {
      if (const double ratio = lone_oscillation(t); ratio > 0) {
        if (events_before_alone < 0) events_before_alone = zeros_.least_events();
        if (zeros_.least_events() > events_before_alone + 3) return zeros_.finish_oscillation(0, ratio);
      }
      std::size_t level = 0;
      while (std::ldexp(kResponseStretch, static_cast<int>(level) + 1) * active_rate(t) <= kResponseStretch &&
             level < 40)
        ++level;
      while (ladder_.size() <= level) ladder_.push_back(ladder_.back() * ladder_.back());
      x = stretch(x, level);
      t += std::ldexp(kResponseStretch, static_cast<int>(level));
    }
    return zeros_.finish(0);
  }

 private:
  double slope_at(const VectorXd& x) const {
    double four[4];
    chain_.first_four(x, four);
    return four[1];
  }

  /// Returns true if only one real pole is left: the response and its derivatives then have no more zeros, and further
  /// sampling would only find zeros due to round-off.
  bool is_lone_decay(double t) const {
    int left = 0;
    for (const std::complex<double>& pole : chain_.sorted_poles()) {
      if (-pole.real() / chain_.rate() * t < kGone) left += pole.imag() == 0 ? 1 : 2;
    }
    return left == 1;
  }

  /// If only one pair of complex poles is left, returns the decay factor over half a cycle; else 0.
  double lone_oscillation(double t) const {
    const std::complex<double>* left = nullptr;
    for (const std::complex<double>& pole : chain_.sorted_poles()) {
      if (pole.imag() < 0 || -pole.real() / chain_.rate() * t >= kGone) continue;
      if (left != nullptr || pole.imag() == 0) return 0;
      left = &pole;
    }
    if (left == nullptr) return 0;
    return std::exp(left->real() / left->imag() * std::acos(-1.0));
  }

  /// Returns the modulus of the fastest remaining mode, relative to the fastest of all.
  double active_rate(double t) const {
    double result = 0;
    for (const std::complex<double>& pole : chain_.sorted_poles()) {
      if (-pole.real() / chain_.rate() * t < kGone) result = std::max(result, std::abs(pole) / chain_.rate());
    }
    return std::max(result, 1e-12);
  }

  VectorXd stretch(const VectorXd& x, std::size_t level) {
    VectorXd end = ladder_[level] * x;
    double at_start[4];
    double at_end[4];
    chain_.first_four(x, at_start);
    chain_.first_four(end, at_end);
    if (!ZeroScan::has_event(at_start, at_end)) return end;
    if (level > 0) return stretch(stretch(x, level - 1), level - 1);
    zeros_.add(chain_.taylor(x, kResponseTaylorTerms), kResponseStretch, chain_.integral(x));
    return end;
  }

  const Chain& chain_;
  ZeroScan zeros_;
  std::vector<MatrixXd> ladder_;  ///< exp(companion kResponseStretch 2^i)
};

}  // namespace

std::vector<std::complex<double>> poles(const Polynomial& denominator) {
  const auto n = static_cast<Eigen::Index>(denominator.size()) - 1;
  std::vector<std::complex<double>> result;
  if (n < 1) return result;
  // A time scale that makes the first and last coefficients equal keeps the companion matrix balanced.
  const double scale = denominator[0] == 0 ? 1
                                           : std::pow(std::abs(denominator[0] / denominator.back()),
                                                      1 / static_cast<double>(n));
  MatrixXd companion = MatrixXd::Zero(n, n);
  for (Eigen::Index k = 0; k + 1 < n; ++k) companion(k, k + 1) = 1;
  for (Eigen::Index k = 0; k < n; ++k) {
    companion(n - 1, k) = -denominator[static_cast<std::size_t>(k)] / denominator.back() /
                          std::pow(scale, static_cast<double>(n - k));
  }
  const Eigen::EigenSolver<MatrixXd> solver(companion, false);
  for (Eigen::Index k = 0; k < n; ++k) result.push_back(solver.eigenvalues()[k] * scale);
  return result;
}

ResponseNorms rational_norms(const TransferFunction& y) {
  const Chain chain(y);
  ResponseNorms norms = Scan(chain).run();
  const double rate = chain.rate();  // int dt is divided by the rate, a derivative is multiplied by it
  norms.integral /= rate;
  norms.integral_abs /= rate;
  norms.step_max_abs /= rate;
  norms.slope_max_abs *= rate;
  norms.curvature_integral *= rate;
  return norms;
}

std::vector<double> rational_samples(const TransferFunction& y, double step_s, int count) {
  const Chain chain(y);
  const double scaled_step = step_s * chain.rate();
  const int halvings = std::max(0, static_cast<int>(std::ceil(std::log2(std::max(scaled_step, 1e-300)))) + 1);
  MatrixXd propagator = chain.propagator(std::ldexp(scaled_step, -halvings));
  for (int i = 0; i < halvings; ++i) propagator = (propagator * propagator).eval();
  std::vector<double> result(static_cast<std::size_t>(count));
  VectorXd x = chain.initial();
  for (double& sample : result) {
    sample = x[0];
    x = propagator * x;
  }
  return result;
}

}  // namespace swarmcert::stability
