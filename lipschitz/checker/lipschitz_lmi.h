/// @file The one matrix inequality that every upper bound rests on, and how a factor shows it.
#pragma once

#include <optional>
#include <vector>

#include "lipschitz/checker/dyadic.h"

namespace swarmcert::check {

/// Lower triangular R with the envelope of a banded Cholesky factor: rows[i] holds the columns that end with column i,
/// as integers in units of 2^unit_exponent. scale[i] is the exponent of the power of two that D has at (i, i).
struct Factor {
  long unit_exponent = 0;
  std::vector<long> scale;
  std::vector<std::vector<mpz_class>> rows;
};

/// A symmetric matrix as its lower triangle, each row from its first column that may be nonzero: what a chain's
/// inequality, which is block tridiagonal, needs of it grows linearly with depth.
class SymmetricMatrix {
 public:
  /// @param first one column per row, at most the row's own.
  explicit SymmetricMatrix(std::vector<int> first);
  /// The lower triangle of a dense one.
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

/// A B.
Matrix product(const Matrix& a, const Matrix& b);

/// Neurons between the stages: the multipliers that lipschitz_lmi() needs.
std::size_t hidden_neurons(const std::vector<Matrix>& stages);

/// The symmetric matrix whose positive semidefiniteness proves |f(x) - f(y)|_2 <= sqrt(rho) |x - y|_2 for the ReLU
/// chain f = M_K relu( ... relu(M_1 x + b_1) ... ) + b_K with any biases (LipSDP-Neuron, Fazlyab et al. 2019), or with
/// any functions of slopes in [0, 1] in place of relu.
///
/// For increments dx, dz_k of the activations and dy_k = M_k dz_{k-1}, slopes in [0, 1] give dz (dy - dz) >= 0 for each
/// neuron.
/// So |df|^2 <= rho |dx|^2 follows if, with multipliers t >= 0, for all (dx, dz_1, ..., dz_{K-1}),
///   rho |dx|^2 - |M_K dz_{K-1}|^2 - 2 sum_k sum_i t_ki dz_ki (dy_ki - dz_ki) >= 0.
/// Minimising this form over dx (its block is rho I, rho > 0) and multiplying by rho leaves a form in dz alone; with
/// T_k = diag(t_k) its matrix, which this returns, has the blocks
///   (1, 1)      2 rho T_1 - T_1 M_1 M_1' T_1
///   (k, k)      2 rho T_k, and - rho M_K' M_K in the last one
///   (k, k - 1)  - rho T_k M_k.
/// Without hidden layers the claim is rho I - M M' >= 0 or, equivalently, rho I - M' M >= 0: the smaller one.
/// @param stages M_1 .. M_K, at least one, each with as many columns as its predecessor has rows.
/// @param rho    positive.
/// @param t      one nonnegative multiplier per hidden neuron, first layer first.
SymmetricMatrix lipschitz_lmi(const std::vector<Matrix>& stages, const Dyadic& rho,
                              const std::vector<Dyadic>& t);

/// The slopes of a function between two stages lie in [low, high].
struct SlopeRange {
  Dyadic low, high;
};

/// M_1 .. M_K with what lies between them: a range of slopes per hidden neuron, first layer first.
struct BentChain {
  std::vector<Matrix> stages;
  std::vector<SlopeRange> slopes;

  bool is_bent() const;  ///< whether a range is another one than [0, 1]
};

/// lipschitz_lmi() of such a chain. Slopes in [a, b] give (dz - a dy) (b dy - dz) >= 0 for each neuron, that is
/// dz ((a + b) dy - dz) - a b dy^2 >= 0. If all are [0, 1], this is the matrix above. Else nothing is minimised out,
/// and the matrix over (dx, dz_1, ..., dz_{K-1}) is quadratic_lmi() with Q = rho I and with a + b times each row of a
/// hidden stage in place of the row, and 2 t a b m m' is added for each neuron, in the block of what its row m' acts
/// on.
/// @throws std::invalid_argument if there is not one range per hidden neuron.
SymmetricMatrix lipschitz_lmi(const BentChain& chain, const Dyadic& rho, const std::vector<Dyadic>& t);

/// The symmetric matrix whose positive semidefiniteness proves |g(v) - g(w)|^2 <= (v - w)' Q (v - w) for the same kind
/// of chain g: the form above with Q in place of rho I, over (dv, dz_1, ..., dz_{K-1}), nothing minimised out. Blocks:
///   (0, 0) Q,  (k, k) 2 T_k,  (k, k - 1) - T_k M_k,  and - M_K' M_K in the last one.
/// @param q symmetric, as many rows as M_1 has columns.
Matrix quadratic_lmi(const std::vector<Matrix>& stages, const Matrix& q, const std::vector<Dyadic>& t);

/// True only if P is positive semidefinite, shown by E = D P D - R R' being diagonally dominant with a nonnegative
/// diagonal: then E >= 0 (Gershgorin), D P D = R R' + E >= 0, and P >= 0 since D is invertible. False means that
/// this factor does not show it, or has another shape than P; not that P is indefinite.
bool shows_positive_semidefinite(const SymmetricMatrix& p, const Factor& factor);
/// The same with a factor that the certificate leaves out, as it does for large matrices: proposed_factor() then.
bool shows_positive_semidefinite(const SymmetricMatrix& p, const std::optional<Factor>& factor);

}  // namespace swarmcert::check
