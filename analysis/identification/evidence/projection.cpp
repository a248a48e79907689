#include "analysis/identification/evidence/projection.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace swarmcert::evidence {
namespace {

/// Returns an orthonormal basis of the columns, without directions that hardly any column has.
Eigen::MatrixXf orthonormal_basis(Eigen::MatrixXf columns) {
  constexpr double kLeast = 1e-5;  // of the largest eigenvalue, of columns of equal length
  for (Eigen::Index c = 0; c < columns.cols(); ++c)
    columns.col(c) /= std::max(columns.col(c).norm(), std::numeric_limits<float>::min());
  const Eigen::MatrixXf gram = columns.transpose() * columns;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> parts(gram.cast<double>());
  const Eigen::VectorXd& all = parts.eigenvalues();
  const Eigen::Index rank = (all.array() > kLeast * all.maxCoeff()).count();
  const Eigen::MatrixXd turn =
      parts.eigenvectors().rightCols(rank) * all.tail(rank).cwiseSqrt().cwiseInverse().asDiagonal();
  return columns * turn.cast<float>();
}

/// Expands numbers by band to rows of the transform.
Eigen::VectorXf by_row(const Spectral& spectral, const Eigen::VectorXd& by_band) {
  Eigen::VectorXf result(spectral.rows());
  for (std::size_t b = 0; b < spectral.bands().size(); ++b) {
    const Band& band = spectral.bands()[b];
    result.segment(band.first, band.count)
        .setConstant(static_cast<float>(by_band[static_cast<Eigen::Index>(b)]));
  }
  return result;
}

/// Returns the sums of squares of rows over each band.
Eigen::VectorXd by_band(const Spectral& spectral, const Eigen::VectorXf& squares) {
  Eigen::VectorXd result(static_cast<Eigen::Index>(spectral.bands().size()));
  for (std::size_t b = 0; b < spectral.bands().size(); ++b) {
    const Band& band = spectral.bands()[b];
    result[static_cast<Eigen::Index>(b)] = squares.segment(band.first, band.count).cast<double>().sum();
  }
  return result;
}

/// The part of the noise's power that belongs to an axis, and the weights 1 / sqrt(S) of its rows.
struct Weights {
  Weights(const Hypotheses& all, const Eigen::VectorXd& power, std::size_t axis)
      : bands(static_cast<Eigen::Index>(all.spectral.bands().size())),
        first(static_cast<Eigen::Index>(axis) * bands),
        of_rows(by_row(all.spectral, power.segment(first, bands).cwiseSqrt().cwiseInverse())) {}
  Eigen::Index bands, first;
  Eigen::VectorXf of_rows;
};

/// Returns a basis of the instruments in whitened rows, by axis, and the power of the noise, from the part of the
/// residual that they do not span. What they span depends on the power, so that both are found in turn.
std::pair<Columns, Eigen::VectorXd> instruments_and_noise(const Hypotheses& all) {
  constexpr int kRounds = 3;
  std::pair<Columns, Eigen::VectorXd> result;
  auto& [bases, power] = result;
  Eigen::VectorXd counts = all.noise.counts(), squares_N2(counts.size());
  power = Eigen::VectorXd::Ones(counts.size());
  for (int round = 0; round < kRounds; ++round) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Weights weights(all, power, axis);
      bases[axis] = orthonormal_basis(weights.of_rows.asDiagonal() * all.instruments[axis]);
      Eigen::VectorXf left = weights.of_rows.cwiseProduct(all.residual_N[axis]);
      left -= bases[axis] * (bases[axis].transpose() * left).eval();
      squares_N2.segment(weights.first, weights.bands) =
          by_band(all.spectral, left.cwiseQuotient(weights.of_rows).cwiseAbs2());
      counts.segment(weights.first, weights.bands) =
          all.noise.counts().segment(weights.first, weights.bands) -
          by_band(all.spectral, bases[axis].rowwise().squaredNorm());
    }
    const Eigen::VectorXd before = power;
    power = all.noise.power(squares_N2, counts);
    // The basis belongs to the power before; a last change below a percent is of no interest.
    if (((power - before).array().abs() < 0.01 * before.array()).all()) break;
  }
  return result;
}

}  // namespace

Projection Projection::on_set_points(const Hypotheses& all) {
  Projection result;
  result.is_on_basis_ = true;
  const auto [bases, power] = instruments_and_noise(all);
  for (std::size_t axis = 0; axis < 3; ++axis)
    result.weighted_[axis] = Weights(all, power, axis).of_rows.asDiagonal() * bases[axis];
  return result;
}

Projection Projection::on_everything(const Hypotheses& all, const Eigen::VectorXd& power) {
  Projection result;
  for (std::size_t axis = 0; axis < 3; ++axis) result.weighted_[axis] = Weights(all, power, axis).of_rows;
  return result;
}

Eigen::MatrixXf Projection::of(const Columns& columns) const {
  std::array<Eigen::MatrixXf, 3> parts;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (is_on_basis_)
      parts[axis] = weighted_[axis].transpose() * columns[axis];
    else
      parts[axis] = weighted_[axis].col(0).asDiagonal() * columns[axis];
  }
  Eigen::MatrixXf result(parts[0].rows() + parts[1].rows() + parts[2].rows(), columns[0].cols());
  result << parts[0], parts[1], parts[2];
  return result;
}

Eigen::VectorXf Projection::of(const std::array<Eigen::VectorXf, 3>& series) const {
  return of(Columns{series[0], series[1], series[2]}).col(0);
}

Eigen::VectorXd power_beside(const Hypotheses& all, const std::vector<int>& columns,
                             const Eigen::VectorXd& coefficients) {
  const auto bands = static_cast<Eigen::Index>(all.spectral.bands().size());
  Eigen::VectorXd squares_N2(3 * bands);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Eigen::VectorXf left = all.residual_N[axis];
    for (std::size_t c = 0; c < columns.size(); ++c)
      left -=
          static_cast<float>(coefficients[static_cast<Eigen::Index>(c)]) * all.columns[axis].col(columns[c]);
    squares_N2.segment(static_cast<Eigen::Index>(axis) * bands, bands) =
        by_band(all.spectral, left.cwiseAbs2());
  }
  return all.noise.power(squares_N2, all.noise.counts());
}

}  // namespace swarmcert::evidence
