/// @file The block tridiagonal matrix S of LipSDP-Neuron for a chain, log det S and its derivatives. Not for users.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "lipschitz/base/stop.h"

namespace swarmcert::lipschitz {

/// The matrix S(rho, t) over (x, z_1, ..., z_{K-1}) for activations with slopes in [1 - c_k, c_k] in hidden layer k;
/// c_k = 1 means slopes in [0, 1]. With g_k = c_k (c_k - 1) and T_k = diag(t_k), its blocks are
///   (0, 0)      rho I - 2 g_1 M_1' T_1 M_1
///   (k, k)      2 T_k - 2 g_{k+1} M_{k+1}' T_{k+1} M_{k+1}, and 2 T_{K-1} - M_K' M_K in the last one
///   (k, k - 1)  - T_k M_k.
/// Hence S = rho A_0 + sum_i t_i A_i - diag(0, M_K' M_K), where A_i = -(p_i q_i' + q_i p_i') for neuron i of layer k,
/// with p_i = e_i + (c_k - 1) m_i, q_i = c_k m_i - e_i, and m_i the row of M_k in the columns of z_{k-1}.
class ChainSlack {
 public:
  /// @param stages M_1 .. M_K, at least two; they must outlive this object.
  /// @param slopes c_1 .. c_{K-1}, each at least 1; empty: all 1.
  explicit ChainSlack(const std::vector<Eigen::MatrixXd>& stages, std::vector<double> slopes = {});

  std::size_t layers() const { return slopes_.size(); }  ///< number of hidden layers, numbered from 1
  Eigen::Index inputs() const { return stages_.front().cols(); }
  Eigen::Index neurons() const { return begin_.back(); }
  Eigen::Index size() const { return inputs() + neurons(); }
  Eigen::Index width(std::size_t k) const { return begin_[k] - begin_[k - 1]; }
  /// Returns the index in y = (rho, t) at which the multipliers of layer k begin.
  Eigen::Index place(std::size_t k) const { return 1 + begin_[k - 1]; }
  /// Returns the diagonal of T_k in y.
  auto multipliers(const Eigen::VectorXd& y, std::size_t k) const { return y.segment(place(k), width(k)); }
  const Eigen::MatrixXd& stage(std::size_t k) const { return stages_[k - 1]; }  ///< M_k
  double slope(std::size_t k) const { return slopes_[k - 1]; }                  ///< c_k
  double bend(std::size_t k) const { return slope(k) * (slope(k) - 1); }        ///< g_k
  const Eigen::MatrixXd& first_gram() const { return first_gram_; }             ///< M_1 M_1'
  const Eigen::MatrixXd& last_gram() const { return last_gram_; }               ///< M_K' M_K
  /// Returns M_K' M_K X.
  Eigen::MatrixXd last_gram_times(const Eigen::Ref<const Eigen::MatrixXd>& x) const;
  /// Returns the lower triangle of block (k, k) of S(y), k >= 0.
  Eigen::MatrixXd diagonal_block(const Eigen::VectorXd& y, std::size_t k) const;

 private:
  const std::vector<Eigen::MatrixXd>& stages_;
  std::vector<double> slopes_;
  std::vector<Eigen::Index> begin_;
  Eigen::MatrixXd first_gram_, last_gram_;
};

/// A point y with quantities derived from S(y). D_k is the Schur complement in block (k, k) after block elimination of
/// the preceding blocks, starting at the inputs.
struct ChainPoint {
  Eigen::VectorXd y;                     ///< (rho, t)
  double log_determinant = 0;            ///< log det S
  Eigen::VectorXd gradient;              ///< gradient of log det S
  std::vector<Eigen::MatrixXd> gram;     ///< G_k = M_k D_{k-1}^-1 M_k', k >= 1
  std::vector<Eigen::MatrixXd> left;     ///< W_k = -T_k M_k D_{k-1}^-1, k >= 2
  std::vector<Eigen::MatrixXd> inverse;  ///< blocks (k, k) of S^-1, k >= 1
};

/// Computes a ChainPoint. Cost: about seven matrix products per layer, of the size of its width.
/// @returns nothing if S(y) is not safely positive definite.
std::optional<ChainPoint> chain_point(const ChainSlack& chain, Eigen::VectorXd y);

/// Returns the lower triangle of the negative Hessian of log det S, H_ij = tr(S^-1 A_i S^-1 A_j).
///
/// For neurons i and j, H_ij = 2 (p_i' Y p_j) (q_i' Y q_j) + 2 (p_i' Y q_j) (q_i' Y p_j) with Y = S^-1: sums of
/// products of entries of Y, M Y, Y M' and M Y M', which are computed one block column at a time. S Y = I gives Y M' in
/// all columns and M Y in the last rows without the preceding blocks of Y. Euler's identity, H y = tr(Y A Y S) + ...,
/// gives the row of rho. Cost: at most 4 n^2 times the width for n neurons.
/// @returns an incomplete matrix if `stop` ends the computation.
Eigen::MatrixXd negative_hessian(const ChainSlack& chain, const ChainPoint& at, const Stop& stop);

/// Returns the lower triangle of M (2 t I - t^2 G)^-1 M', the step of ECLipsE-Fast (Xu and Sivaranjani 2024).
/// @param gram G with t G <= I; its lower triangle is read.
/// @returns an empty matrix if 2 t I - t^2 G is not safely positive definite.
Eigen::MatrixXd layerwise_gram(const Eigen::MatrixXd& m, const Eigen::MatrixXd& gram, double t);

}  // namespace swarmcert::lipschitz
