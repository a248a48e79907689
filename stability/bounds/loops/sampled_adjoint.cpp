#include "stability/bounds/loops/sampled_adjoint.h"

#include <Eigen/Dense>
#include <algorithm>
#include <complex>

#include "nn/base/doubles.h"

namespace swarmcert::stability {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;

namespace {

constexpr double kGoneExponent = 42;    ///< modes that have decayed to exp(-kGoneExponent) are gone
constexpr double kLeastModulus = 1e-6;  ///< smaller ones decay within a few periods

}  // namespace

double largest_modulus(const MatrixXd& map) {
  return Eigen::EigenSolver<MatrixXd>(map, false).eigenvalues().cwiseAbs().maxCoeff();
}

SampledAdjoint::SampledAdjoint(const SampledLoop& loop, Output output)
    : period_s_(loop.period_s), output_(output), model_(loop), map_(model_.map()) {
  const Eigen::VectorXcd modes = Eigen::EigenSolver<MatrixXd>(map_, false).eigenvalues();
  Index slowest = 0;
  for (Index i = 0; i < modes.size(); ++i) {
    if (std::abs(modes[i]) > std::abs(modes[slowest])) slowest = i;
  }
  const double modulus = std::abs(modes[slowest]);
  if (!(modulus < 1)) return;
  const bool is_pair = modes[slowest].imag() != 0;
  double next = kLeastModulus;
  for (Index i = 0; i < modes.size(); ++i) {
    const bool is_slowest = i == slowest || (is_pair && modes[i] == std::conj(modes[slowest]));
    if (!is_slowest) next = std::max(next, std::abs(modes[i]));
  }
  // Repeated modes, such as those of a delay, take some more periods to decay.
  constexpr double kMore = 60;
  const double until_gone = kGoneExponent / -std::log(std::max(modulus, kLeastModulus)) + kMore;
  const double until_alone = next < modulus ? kGoneExponent / std::log(modulus / next) + kMore : kInfinity;
  const bool ends_alone = until_alone < until_gone;
  const bool ends_with_series = ends_alone && !is_pair && modes[slowest].real() > 0;
  const double periods = ends_with_series ? until_alone : until_gone;
  if (periods > kMostPeriods) return;
  is_stable_ = true;
  periods_ = static_cast<long>(std::ceil(periods));
  if (ends_with_series) ratio_ = modulus;
  if (ends_alone && is_pair) {
    last_pair_ = {static_cast<long>(std::ceil(until_alone)),
                  {modes[slowest].real(), std::abs(modes[slowest].imag())}};
  }
  for (const std::complex<double>& mode : modes) {
    const double decay = -std::log(std::max(std::abs(mode), kLeastModulus));
    modes_.push_back({kGoneExponent / decay, std::hypot(decay, std::arg(mode))});
  }
}

double SampledAdjoint::fastest_mode(long period) const {
  if (period < map_.rows() + 2) return kInfinity;
  double fastest = kLeastModulus;
  for (const Mode& mode : modes_) {
    if (mode.gone_after > static_cast<double>(period)) fastest = std::max(fastest, mode.rate);
  }
  return fastest;
}

RowVectorXd SampledAdjoint::output_after_control(double phase_s) const {
  if (output_ == Output::kError) return model_.error_at(phase_s);
  return RowVectorXd::Unit(model_.size() + 1,
                           output_ == Output::kIntegral ? model_.integral_index() : model_.command_index());
}

}  // namespace swarmcert::stability
