#include "stability/bounds/swarms/unstable_swarm.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace swarmcert::stability {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::size_t kMostCombined = 8;
constexpr double kGrown = 1000;

/// States per vehicle: int e, e, e', lag outputs (accelerations; the last one acts).
MatrixXd swarm_matrix(const AxisLoop& loop, int vehicles, const std::vector<Coupling>& couplings,
                      const std::vector<int>& sign) {
  std::vector<double> lags_s;
  for (const double tau : loop.lags_s) {
    if (tau > 0) lags_s.push_back(tau);
  }
  const auto lags = static_cast<Index>(lags_s.size());
  const Index n = 3 + lags;
  MatrixXd A = MatrixXd::Zero(n * vehicles, n * vehicles);
  // Index at which a commanded acceleration enters: the first lag, or e' itself.
  const Index command = lags > 0 ? n - 1 : 2;
  const double gain = lags > 0 ? 1 / lags_s.back() : 1;
  for (Index i = 0; i < vehicles; ++i) {
    const Index at = i * n;
    A(at, at + 1) = 1;
    A(at + 1, at + 2) = 1;
    if (lags > 0) A(at + 2, at + 3) = 1;
    for (Index k = 0; k < lags; ++k) {
      const double rate = 1 / lags_s[static_cast<std::size_t>(k)];
      A(at + 3 + k, at + 3 + k) -= rate;
      if (k + 1 < lags) A(at + 3 + k, at + 4 + k) += rate;
    }
    A(at + command, at) -= gain * loop.Ki;
    A(at + command, at + 1) -= gain * loop.Kp;
    A(at + command, at + 2) -= gain * loop.Kd;
  }
  for (std::size_t c = 0; c < couplings.size(); ++c) {
    const Index on = couplings[c].on * n;
    const Index by = couplings[c].by * n;
    const double scale = gain * sign[c] / loop.mass_kg;
    A(on + command, on + 1) += scale * couplings[c].position_N_m;
    A(on + command, by + 1) -= scale * couplings[c].position_N_m;
    A(on + command, on + 2) += scale * couplings[c].velocity_N_s_m;
    A(on + command, by + 2) -= scale * couplings[c].velocity_N_s_m;
  }
  return A;
}

/// Returns the largest |e| of any vehicle relative to the initial displacement of one vehicle.
double replayed_growth(const MatrixXd& A, int vehicles, double seconds) {
  const double step_s = 0.1 / Eigen::EigenSolver<MatrixXd>(A, false).eigenvalues().cwiseAbs().maxCoeff();
  const auto steps = static_cast<long>(std::min(seconds / step_s, 2e6));
  const Index n = A.rows() / vehicles;
  VectorXd x = VectorXd::Zero(A.rows());
  x[1] = 1;
  double most = 0;
  for (long i = 0; i < steps && most < kGrown; ++i) {
    const VectorXd a = A * x;
    const VectorXd b = A * (x + step_s / 2 * a);
    const VectorXd c = A * (x + step_s / 2 * b);
    const VectorXd d = A * (x + step_s * c);
    x += step_s / 6 * (a + 2 * b + 2 * c + d);
    for (Index v = 0; v < vehicles; ++v) most = std::max(most, std::abs(x[v * n + 1]));
  }
  return most;
}

}  // namespace

std::optional<UnstableSwarm> find_unstable_swarm(const AxisLoop& loop, int vehicles,
                                                 const std::vector<Coupling>& couplings) {
  check_couplings(couplings, vehicles);
  if (loop.delay_s > 0 || couplings.empty()) return std::nullopt;
  UnstableSwarm worst;
  const std::size_t count = couplings.size();
  const bool combines = count <= kMostCombined;
  for (std::size_t code = 0; code < (combines ? std::size_t{1} << count : 2); ++code) {
    std::vector<int> sign(count);
    bool is_new = true;
    for (std::size_t c = 0; c < count; ++c) {
      sign[c] = (combines ? code >> c : code) % 2 == 0 ? 1 : -1;
      const int stated = couplings[c].direction;
      if (stated != 0 && stated != sign[c] && combines) is_new = false;
      if (stated != 0) sign[c] = stated;
    }
    if (!is_new) continue;
    const MatrixXd A = swarm_matrix(loop, vehicles, couplings, sign);
    const double growth = Eigen::EigenSolver<MatrixXd>(A, false).eigenvalues().real().maxCoeff();
    if (growth > worst.growth_1_s) worst.growth_1_s = growth, worst.sign = sign;
  }
  // Slower growth cannot be distinguished from round-off and is not relevant in practice.
  if (!(worst.growth_1_s > 1e-3)) return std::nullopt;
  worst.is_declared =
      std::all_of(couplings.begin(), couplings.end(), [](const Coupling& c) { return c.direction != 0; });
  worst.seconds = 5 * std::log(kGrown) / worst.growth_1_s;
  worst.largest_error =
      replayed_growth(swarm_matrix(loop, vehicles, couplings, worst.sign), vehicles, worst.seconds);
  if (!(worst.largest_error >= kGrown)) return std::nullopt;
  return worst;
}

}  // namespace swarmcert::stability
