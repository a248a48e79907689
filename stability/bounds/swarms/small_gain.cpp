#include "stability/bounds/swarms/small_gain.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace swarmcert::stability {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd coupling_matrix(const std::vector<LoopGains>& loops, const std::vector<Coupling>& couplings) {
  const auto n = static_cast<Index>(loops.size());
  MatrixXd Gamma = MatrixXd::Zero(n, n);
  for (const Coupling& c : couplings) {
    // |v_rel| <= V + g1 (D_on + D_by): the loops of both vehicles turn rates into motion.
    const auto gain = [&c](const LoopGains& loop) {
      return c.position_N_m * loop.velocity + c.velocity_N_s_m * loop.acceleration;
    };
    Gamma(c.on, c.by) += gain(loops[static_cast<std::size_t>(c.by)]);
    Gamma(c.on, c.on) += gain(loops[static_cast<std::size_t>(c.on)]);
  }
  return Gamma;
}

/// Collatz-Wielandt bounds: for a nonnegative matrix and any positive x, max_i (Gx)_i/x_i is an upper bound on the
/// spectral radius and min_i a lower bound.
void enclose(const MatrixXd& Gamma, double& lower, double& upper) {
  const Index n = Gamma.rows();
  // I + G has the same eigenvector and converges where iterating G alone would cycle; a floor keeps x positive.
  VectorXd x = VectorXd::Ones(n);
  for (int i = 0; i < 2000; ++i) {
    x = (x + Gamma * x).eval();
    x /= x.maxCoeff();
    x = x.cwiseMax(1e-9);
  }
  const VectorXd ratio = (Gamma * x).cwiseQuotient(x);
  upper = ratio.maxCoeff() * (1 + 1e-14 * static_cast<double>(n));
  lower = std::max(0.0, ratio.minCoeff() * (1 - 1e-14 * static_cast<double>(n)));
}

/// Rates due to the motion of the references and the vehicles' own motion, through the couplings, per vehicle, N/s.
VectorXd rates_from_outside(std::size_t vehicles, const std::vector<Coupling>& couplings,
                            const std::vector<OwnMotion>& own) {
  VectorXd b = VectorXd::Zero(static_cast<Index>(vehicles));
  for (const Coupling& c : couplings) {
    double speed_m_s = c.speed_m_s;
    double acceleration_m_s2 = c.acceleration_m_s2;
    for (const int vehicle : {c.on, c.by}) {
      if (own.empty()) break;
      const OwnMotion& motion = own[static_cast<std::size_t>(vehicle)];
      speed_m_s += motion.speed_m_s;
      acceleration_m_s2 += motion.acceleration_m_s2;
    }
    // A coupling of zero contributes nothing, even if the motion is unbounded.
    if (c.position_N_m > 0) b[c.on] += c.position_N_m * speed_m_s;
    if (c.velocity_N_s_m > 0) b[c.on] += c.velocity_N_s_m * acceleration_m_s2;
    b[c.on] += c.cross_rate_N_s;
  }
  return b;
}

bool closes(const MatrixXd& Gamma) {
  double lower = 0;
  double upper = 0;
  enclose(Gamma, lower, upper);
  return upper < 1;
}

}  // namespace

void check_couplings(const std::vector<Coupling>& couplings, int vehicles) {
  for (const Coupling& c : couplings) {
    if (c.on < 0 || c.by < 0 || c.on >= vehicles || c.by >= vehicles || c.on == c.by) {
      throw std::invalid_argument("small_gain: coupling of " + std::to_string(c.on) + " by " +
                                  std::to_string(c.by) + " in a swarm of " + std::to_string(vehicles));
    }
    for (const double value :
         {c.position_N_m, c.velocity_N_s_m, c.speed_m_s, c.acceleration_m_s2, c.cross_rate_N_s}) {
      if (!(value >= 0)) throw std::invalid_argument("small_gain: negative bound " + std::to_string(value));
    }
  }
}

SmallGain small_gain(const std::vector<LoopGains>& loops, const std::vector<Coupling>& couplings,
                     const std::vector<OwnMotion>& own) {
  const auto n = static_cast<Index>(loops.size());
  check_couplings(couplings, static_cast<int>(n));
  SmallGain result;
  const MatrixXd Gamma = coupling_matrix(loops, couplings);
  for (Index i = 0; i < n; ++i) {
    const VectorXd row = Gamma.row(i);
    result.Gamma.emplace_back(row.data(), row.data() + n);
  }
  enclose(Gamma, result.spectral_radius_lower, result.spectral_radius_upper);
  result.proved = result.spectral_radius_upper < 1;
  if (!result.proved) {
    result.missing_factor = 1 / result.spectral_radius_upper;
    for (std::size_t k = 0; k < couplings.size(); ++k) {
      double low = 0;
      double high = 1;
      const auto closes_at = [&](double factor) {
        std::vector<Coupling> weaker = couplings;
        weaker[k].position_N_m *= factor;
        weaker[k].velocity_N_s_m *= factor;
        return closes(coupling_matrix(loops, weaker));
      };
      if (closes_at(0)) {
        for (int i = 0; i < 40; ++i) {
          const double middle = (low + high) / 2;
          (closes_at(middle) ? low : high) = middle;
        }
      }
      result.missing_factor_of.push_back(low);
    }
    return result;
  }
  const VectorXd b = rates_from_outside(loops.size(), couplings, own);
  const VectorXd D = b.allFinite() ? VectorXd((MatrixXd::Identity(n, n) - Gamma).partialPivLu().solve(b))
                                   : VectorXd(VectorXd::Constant(n, std::numeric_limits<double>::infinity()));
  for (std::size_t i = 0; i < loops.size(); ++i) {
    const double rate_N_s = D[static_cast<Index>(i)];
    result.rate_N_s.push_back(rate_N_s);
    result.error_m.push_back(loops[i].position * rate_N_s + (own.empty() ? 0 : own[i].error_m));
  }
  return result;
}

}  // namespace swarmcert::stability
