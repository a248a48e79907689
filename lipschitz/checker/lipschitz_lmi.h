/// @file The matrix inequality behind every upper bound, and its proof by a factor.
#pragma once

#include <optional>
#include <vector>

#include "lipschitz/checker/dyadic.h"

namespace swarmcert::check {

/// A lower triangular matrix R with the envelope of a banded Cholesky factor, and a diagonal scaling D. rows[i]
/// contains consecutive columns of row i up to the diagonal, as integers in units of 2^unit_exponent. D_ii =
/// 2^scale[i].
struct Factor {
  long unit_exponent = 0;
  std::vector<long> scale;
  std::vector<std::vector<mpz_class>> rows;
};

/// The lower triangle of a symmetric matrix; each row is stored from its first column that may be nonzero. The storage
/// for the block tridiagonal inequality of a chain grows linearly with depth.
class SymmetricMatrix {
 public:
  /// @param first one column per row, at most the row's own.
  explicit SymmetricMatrix(std::vector<int> first);
  /// Takes the lower triangle of a dense symmetric matrix.
  SymmetricMatrix(const Matrix& dense);  // NOLINT(google-explicit-constructor): nothing is lost

  int size() const { return static_cast<int>(rows_.size()); }
  int first(int i) const { return first_[static_cast<std::size_t>(i)]; }
  /// Precondition: first(i) <= j <= i.
  Dyadic& at(int i, int j) {
    return rows_[static_cast<std::size_t>(i)][static_cast<std::size_t>(j - first(i))];
  }
  const Dyadic& at(int i, int j) const {
    return rows_[static_cast<std::size_t>(i)][static_cast<std::size_t>(j - first(i))];
  }

 private:
  std::vector<int> first_;
  std::vector<std::vector<Dyadic>> rows_;
};

/// Returns A B.
Matrix product(const Matrix& a, const Matrix& b);

/// Returns the number of neurons between the stages, that is the number of multipliers of lipschitz_lmi().
std::size_t hidden_neurons(const std::vector<Matrix>& stages);

/// Returns the symmetric matrix whose positive semidefiniteness proves |f(x) - f(y)|_2 <= sqrt(rho) |x - y|_2 for the
/// ReLU chain f = M_K relu( ... relu(M_1 x + b_1) ... ) + b_K with any biases (LipSDP-Neuron, Fazlyab et al. 2019), or
/// with any functions with slopes in [0, 1] in place of relu.
///
/// For increments dx, dz_k of the activations and dy_k = M_k dz_{k-1}, slopes in [0, 1] give dz (dy - dz) >= 0 for each
/// neuron. Hence |df|^2 <= rho |dx|^2 if, with multipliers t >= 0, for all (dx, dz_1, ..., dz_{K-1}),
///   rho |dx|^2 - |M_K dz_{K-1}|^2 - 2 sum_k sum_i t_ki dz_ki (dy_ki - dz_ki) >= 0.
/// Minimising this form over dx (its block is rho I, rho > 0) and multiplying by rho leaves a form in dz alone. With
/// T_k = diag(t_k), its matrix, which is returned, has the blocks
///   (1, 1)      2 rho T_1 - T_1 M_1 M_1' T_1
///   (k, k)      2 rho T_k, and additionally - rho M_K' M_K in the last block
///   (k, k - 1)  - rho T_k M_k.
/// Without hidden layers, the matrix is the smaller one of rho I - M M' and rho I - M' M, which are equivalent.
/// @param stages M_1 .. M_K, at least one, each with as many columns as its predecessor has rows.
/// @param rho    positive.
/// @param t      one nonnegative multiplier per hidden neuron, first layer first.
SymmetricMatrix lipschitz_lmi(const std::vector<Matrix>& stages, const Dyadic& rho,
                              const std::vector<Dyadic>& t);

/// The slopes of the activation of a neuron lie in [low, high].
struct SlopeRange {
  Dyadic low, high;
};

/// A chain M_1 .. M_K with one slope range per hidden neuron, first layer first.
struct BentChain {
  std::vector<Matrix> stages;
  std::vector<SlopeRange> slopes;  ///< [-1, 1] in layers of groups
  /// Size of the groups of adjacent numbers in each hidden layer, 1 where each number is by itself. A group comes no
  /// further apart than what enters it, and keeps its sum, as sorting does. Empty: all 1.
  std::vector<int> groups = {};

  bool is_bent() const;  ///< whether any range differs from [0, 1]
  /// Returns the number of multipliers t: one per neuron that is by itself; of each layer of groups one per group for
  /// its distance, then one per group for its sum.
  std::size_t multipliers() const;
};

/// lipschitz_lmi() of such a chain. Slopes in [a, b] give (dz - a dy) (b dy - dz) >= 0 for each neuron, that is
/// dz ((a + b) dy - dz) - a b dy^2 >= 0. If all ranges are [0, 1], this is the matrix above. Otherwise no variable is
/// eliminated: the matrix over (dx, dz_1, ..., dz_{K-1}) is quadratic_lmi() with Q = rho I, in which each row m' of a
/// hidden stage is multiplied by a + b, and 2 t a b m m' is added for each neuron, in the diagonal block of the
/// variables on which m' acts. In a group |dz|^2 <= |dy|^2: its neurons share t, and a = -1, b = 1. Its sum gives
/// 1'(dy - dz) = 0, so that any multiple of the square of this may be added (P. Pauli et al., "Novel quadratic
/// constraints for extending LipSDP beyond slope-restricted activations", 2024).
/// @param t multipliers() of them.
/// @throws std::invalid_argument if there is not one range per hidden neuron, or a layer is no multiple of its group.
SymmetricMatrix lipschitz_lmi(const BentChain& chain, const Dyadic& rho, const std::vector<Dyadic>& t);

/// Returns the symmetric matrix whose positive semidefiniteness proves |g(v) - g(w)|^2 <= (v - w)' Q (v - w) for a
/// chain g as above: the quadratic form above with Q in place of rho I, over (dv, dz_1, ..., dz_{K-1}), with no
/// variable eliminated. Blocks:
///   (0, 0) Q,  (k, k) 2 T_k,  (k, k - 1) - T_k M_k,  and additionally - M_K' M_K in the last block.
/// @param q symmetric, as many rows as M_1 has columns.
Matrix quadratic_lmi(const std::vector<Matrix>& stages, const Matrix& q, const std::vector<Dyadic>& t);

/// Returns true only if P is positive semidefinite, proved by E = D P D - R R' being diagonally dominant with a
/// nonnegative diagonal: then E >= 0 (Gershgorin), D P D = R R' + E >= 0, and P >= 0 because D is invertible. False
/// means that this factor does not prove it or has another shape than P; it does not mean that P is indefinite.
bool shows_positive_semidefinite(const SymmetricMatrix& p, const Factor& factor);
/// The same; uses proposed_factor() if the certificate omits the factor, as it does for large matrices.
bool shows_positive_semidefinite(const SymmetricMatrix& p, const std::optional<Factor>& factor);

}  // namespace swarmcert::check
