#include "lipschitz/solver/chain_slack.h"

#include <cmath>

#include "lipschitz/solver/dense_kernels.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Ref;
using Eigen::VectorXd;

MatrixXd product(const Ref<const MatrixXd>& a, const Ref<const MatrixXd>& b) {
  MatrixXd result = MatrixXd::Zero(a.rows(), b.cols());
  add_product(result, a, b);
  return result;
}

void fill_upper(MatrixXd& x) { x.triangularView<Eigen::StrictlyUpper>() = x.transpose(); }

/// A A'.
MatrixXd gram_of(const Ref<const MatrixXd>& a) {
  MatrixXd result = MatrixXd::Zero(a.rows(), a.rows());
  add_lower_gram(result, 1, a);
  fill_upper(result);
  return result;
}

}  // namespace

ChainSlack::ChainSlack(const std::vector<MatrixXd>& stages, std::vector<double> slopes)
    : stages_(stages), slopes_(std::move(slopes)), begin_{0} {
  slopes_.resize(stages.size() - 1, 1.0);
  for (std::size_t k = 1; k <= layers(); ++k) begin_.push_back(begin_.back() + stage(k).rows());
  first_gram_ = gram_of(stages.front());
  last_gram_ = gram_of(stages.back().transpose());
}

MatrixXd ChainSlack::last_gram_times(const Ref<const MatrixXd>& x) const {
  const MatrixXd& last = stages_.back();
  if (2 * last.rows() > last.cols()) return product(last_gram_, x);
  return product(last.transpose(), product(last, x));
}

MatrixXd ChainSlack::diagonal_block(const VectorXd& y, std::size_t k) const {
  MatrixXd block;
  if (k == layers())
    block = -last_gram_;
  else
    block = MatrixXd::Zero(stage(k + 1).cols(), stage(k + 1).cols());
  if (k < layers() && bend(k + 1) > 0) {
    const VectorXd weights = (2 * bend(k + 1) * multipliers(y, k + 1)).cwiseSqrt();
    add_lower_gram(block, -1, stage(k + 1).transpose() * weights.asDiagonal());
  }
  if (k == 0)
    block.diagonal().array() += y(0);
  else
    block.diagonal() += 2.0 * multipliers(y, k);
  return block;
}

namespace {

/// L_k with D_k = L_k L_k', and B_k = M_k L_{k-1}^-T. lower[0] and half[1] are empty if D_0 = rho I.
struct Elimination {
  std::vector<MatrixXd> lower, half;
};

double log_determinant_of(const MatrixXd& lower) { return 2 * lower.diagonal().array().log().sum(); }

/// Fills in all of `at` except the inverse; returns nothing if S is not safely positive definite.
std::optional<Elimination> eliminate(const ChainSlack& chain, ChainPoint& at) {
  const VectorXd& y = at.y;
  if (!(y.minCoeff() > 0)) return std::nullopt;  // diagonal entries of S would be negative
  const std::size_t blocks = chain.layers() + 1;
  Elimination found;
  found.lower.resize(blocks);
  found.half.resize(blocks);
  at.gram.resize(blocks);
  at.log_determinant = 0;
  for (std::size_t k = 0; k < blocks; ++k) {
    if (k == 0 && chain.bend(1) == 0) {  // D_0 = rho I
      at.log_determinant += static_cast<double>(chain.inputs()) * std::log(y(0));
      continue;
    }
    MatrixXd d = chain.diagonal_block(y, k);
    if (k == 1 && chain.bend(1) == 0) {
      at.gram[k] = chain.first_gram() / y(0);
    } else if (k > 0) {
      found.half[k] = chain.stage(k);
      divide_by_lower_transposed(found.half[k], found.lower[k - 1]);
      at.gram[k] = gram_of(found.half[k]);
    }
    if (k > 0) {
      const auto t = chain.multipliers(y, k);
      d -= t.asDiagonal() * at.gram[k] * t.asDiagonal();
    }
    if (!cholesky_in_place(d)) return std::nullopt;
    at.log_determinant += log_determinant_of(d);
    found.lower[k] = std::move(d);
  }
  return found;
}

void invert_blocks(const ChainSlack& chain, const Elimination& found, ChainPoint& at) {
  const std::size_t layers = chain.layers();
  at.inverse.resize(layers + 1);
  at.left.resize(layers + 1);
  for (std::size_t k = 1; k <= layers; ++k) at.inverse[k] = inverse_from_cholesky(found.lower[k]);
  for (std::size_t k = layers; k > 1; --k) {  // Y_k-1,k-1 = D_k-1^-1 + W_k' Y_kk W_k
    at.left[k] = -(chain.multipliers(at.y, k).asDiagonal() * found.half[k]);
    divide_by_lower(at.left[k], found.lower[k - 1]);
    if (k == layers) {  // Y_kk = D_k^-1
      MatrixXd half = at.left[k].transpose();
      divide_by_lower_transposed(half, found.lower[k]);
      add_lower_gram(at.inverse[k - 1], 1, half);
      fill_upper(at.inverse[k - 1]);
    } else {
      add_symmetric_product_transposed(at.inverse[k - 1], at.left[k], product(at.inverse[k], at.left[k]));
    }
  }
}

/// Returns the row sums of the elementwise product of A and B.
VectorXd row_sums(const MatrixXd& a, const MatrixXd& b) { return a.cwiseProduct(b).rowwise().sum(); }

/// Gradient of log det S: tr(Y A_i) = -2 p_i' Y q_i = 2 (Y - Y M' - g M Y M')_ii; for rho from Euler's identity,
/// tr(Y S) = size.
VectorXd gradient(const ChainSlack& chain, const ChainPoint& at) {
  VectorXd result(1 + chain.neurons());
  for (std::size_t k = 1; k <= chain.layers(); ++k) {
    const MatrixXd f = chain.multipliers(at.y, k).asDiagonal() * at.gram[k];  // Y_k,k-1 M_k' = Y_kk F_k
    const MatrixXd& inverse = at.inverse[k];
    VectorXd rest = row_sums(inverse, f.transpose());
    if (chain.bend(k) > 0)
      rest +=
          chain.bend(k) * (at.gram[k].diagonal() + row_sums(product(f.transpose(), inverse), f.transpose()));
    result.segment(chain.place(k), chain.width(k)) = 2.0 * (inverse.diagonal() - rest);
  }
  const double of_last = at.inverse.back().cwiseProduct(chain.last_gram()).sum();
  result(0) = (static_cast<double>(chain.size()) + of_last -
               at.y.tail(chain.neurons()).dot(result.tail(chain.neurons()))) /
              at.y(0);
  return result;
}

}  // namespace

std::optional<ChainPoint> chain_point(const ChainSlack& chain, VectorXd y) {
  ChainPoint at;
  at.y = std::move(y);
  const std::optional<Elimination> found = eliminate(chain, at);
  if (!found) return std::nullopt;
  invert_blocks(chain, *found, at);
  at.gradient = gradient(chain, at);
  return at;
}

namespace {

/// Block column j of Y = S^-1 from its diagonal block down, and the products that the Hessian needs. The rows of layer
/// i contain Y_ij, M_i Y_i-1,j, Y_i,j-1 M_j' and M_i Y_i-1,j-1 M_j'.
struct InverseColumn {
  MatrixXd y, m_y, y_m, m_y_m;
  MatrixXd gram_y, gram_y_m;  ///< M_K' M_K times the last rows of y and of y_m
};

class HessianColumns {
 public:
  HessianColumns(const ChainSlack& chain, const ChainPoint& at) : chain_(chain), at_(at) {}

  /// @param y block column j of Y.
  InverseColumn column(std::size_t j, MatrixXd y) const {
    const std::size_t last = chain_.layers();
    const Index width = chain_.width(j), rows = y.rows(), end = chain_.width(last);
    InverseColumn c;
    c.gram_y = chain_.last_gram_times(y.bottomRows(end));
    c.m_y.resize(rows, width);
    c.m_y_m.resize(rows, width);
    c.m_y.bottomRows(end) = last_rows(y.bottomRows(end), c.gram_y);
    if (j == last) {
      c.m_y.diagonal() -= chain_.multipliers(at_.y, last).cwiseInverse();
      c.y_m = c.m_y.transpose();
    } else {
      const MatrixXd f = chain_.multipliers(at_.y, j).asDiagonal() * at_.gram[j];
      c.y_m = times_f(y, f, j);
      c.m_y.topRows(width) = c.y_m.topRows(width).transpose();
      for (std::size_t i = j + 1; i < last; ++i)
        c.m_y.middleRows(from(i, j), chain_.width(i)) =
            product(chain_.stage(i), y.middleRows(from(i - 1, j), chain_.width(i - 1)));
      const Index between = rows - width - end;
      c.m_y_m.middleRows(width, between) = times_f(c.m_y.middleRows(width, between), f, j);
      MatrixXd own = at_.gram[j];
      add_symmetric_product_transposed(own, f, c.y_m.topRows(width));
      c.m_y_m.topRows(width) = own;
    }
    c.gram_y_m = chain_.last_gram_times(c.y_m.bottomRows(end));
    c.m_y_m.bottomRows(end) = last_rows(c.y_m.bottomRows(end), c.gram_y_m);
    c.y = std::move(y);
    return c;
  }

  /// Returns block column j - 1 of Y from block column j >= 2.
  MatrixXd before(std::size_t j, const MatrixXd& y) const {
    const Index width = chain_.width(j - 1);
    MatrixXd result(width + y.rows(), width);
    result.topRows(width) = at_.inverse[j - 1];
    result.bottomRows(y.rows()) = product(-y, at_.left[j]);
    return result;
  }

  /// Returns where the rows of layer i begin among the rows from layer j on.
  Index from(std::size_t i, std::size_t j) const { return chain_.place(i) - chain_.place(j); }

 private:
  /// Returns M_K-1 times block K - 2 of Y, from row K - 1 of S Y = I off the diagonal: T M Y_before = (2 T - M_K' M_K)
  /// Y.
  MatrixXd last_rows(const Ref<const MatrixXd>& y, const MatrixXd& gram_y) const {
    const auto t = chain_.multipliers(at_.y, chain_.layers());
    return 2 * y - t.cwiseInverse().asDiagonal() * gram_y;
  }

  /// Returns X F_j. F_1 = T_1 M_1 M_1' / rho may have low rank.
  MatrixXd times_f(const Ref<const MatrixXd>& x, const MatrixXd& f, std::size_t j) const {
    const MatrixXd& stage = chain_.stage(j);
    if (j > 1 || chain_.bend(1) > 0 || 2 * stage.cols() > stage.rows()) return product(x, f);
    const MatrixXd scaled = chain_.multipliers(at_.y, 1).asDiagonal() * stage / at_.y(0);
    return product(product(x, scaled), stage.transpose());
  }

  const ChainSlack& chain_;
  const ChainPoint& at_;
};

}  // namespace

MatrixXd negative_hessian(const ChainSlack& chain, const ChainPoint& at, const Stop& stop) {
  const Index n = chain.neurons();
  const std::size_t last = chain.layers();
  const HessianColumns columns(chain, at);
  MatrixXd h(1 + n, 1 + n);
  VectorXd of_gram(1 + n);  // tr(A_i Y diag(0, M_K' M_K) Y)
  const MatrixXd gram_inverse = chain.last_gram_times(at.inverse.back());
  MatrixXd y = at.inverse.back();
  for (std::size_t j = last; j > 0 && !stop.now(); --j) {
    const InverseColumn c = columns.column(j, std::move(y));
    const double c_j = chain.slope(j), d_j = c_j - 1;
    for (std::size_t i = j; i <= last; ++i) {
      const double c_i = chain.slope(i), d_i = c_i - 1;
      const auto rows = [&](const MatrixXd& x) {
        return x.middleRows(columns.from(i, j), chain.width(i)).array();
      };
      const auto yy = rows(c.y), my = rows(c.m_y), ym = rows(c.y_m), mym = rows(c.m_y_m);
      h.block(chain.place(i), chain.place(j), chain.width(i), chain.width(j)).array() =
          2 * ((yy + d_i * my + d_j * ym + d_i * d_j * mym) * (yy - c_i * my - c_j * ym + c_i * c_j * mym) +
               (yy + d_i * my - c_j * ym - d_i * c_j * mym) * (yy - c_i * my + d_j * ym - c_i * d_j * mym));
    }
    const Index end = chain.width(last);
    of_gram.segment(chain.place(j), chain.width(j)) =
        -2.0 * ((c.y + d_j * c.y_m).bottomRows(end).cwiseProduct(c_j * c.gram_y_m - c.gram_y))
                   .colwise()
                   .sum()
                   .transpose();
    if (j > 1) y = columns.before(j, c.y);
  }
  if (stop.now()) return h;
  // H y = tr(Y A Y (S + diag(0, M_K' M_K))).
  const auto t = at.y.tail(n);
  of_gram(0) = (gram_inverse.trace() + gram_inverse.cwiseProduct(gram_inverse.transpose()).sum() -
                t.dot(of_gram.tail(n))) /
               at.y(0);
  VectorXd rest = at.gradient + of_gram;
  VectorXd only_t = at.y;
  only_t(0) = 0;
  h.col(0).setZero();
  add_symmetric_product(rest, -1, h, only_t);
  h.col(0).tail(n) = rest.tail(n) / at.y(0);
  h(0, 0) = (rest(0) - h.col(0).tail(n).dot(t)) / at.y(0);
  return h;
}

MatrixXd layerwise_gram(const MatrixXd& m, const MatrixXd& gram, double t) {
  MatrixXd d = -t * t * gram;
  d.diagonal().array() += 2 * t;
  if (!cholesky_in_place(d)) return {};
  MatrixXd half = m;
  divide_by_lower_transposed(half, d);
  MatrixXd result = MatrixXd::Zero(half.rows(), half.rows());
  add_lower_gram(result, 1, half);
  return result;
}

}  // namespace swarmcert::lipschitz
