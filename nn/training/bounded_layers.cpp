#include "nn/training/bounded_layers.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

#include "nn/training/spectral_normalization.h"

namespace swarmcert::training {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Keeps the scale factor of a zero column finite.
constexpr double kLeastSum = 1e-12;

/// A map from matrices to matrices of the same size with norm at most one, and the transpose of its derivative.
struct Contraction {
  MatrixXd (*value)(const MatrixXd& v);
  MatrixXd (*pull_back)(const MatrixXd& v, const MatrixXd& gradient);
};

VectorXd aol_sums(const MatrixXd& products) {
  return products.cwiseAbs().rowwise().sum().cwiseMax(kLeastSum);
}

MatrixXd aol(const MatrixXd& v) {
  return v * aol_sums(v.transpose() * v).cwiseSqrt().cwiseInverse().asDiagonal();
}

MatrixXd aol_pull_back(const MatrixXd& v, const MatrixXd& gradient) {
  const MatrixXd products = v.transpose() * v;
  const VectorXd sums = aol_sums(products);
  const VectorXd factors = sums.cwiseSqrt().cwiseInverse();
  const VectorXd by_factor = gradient.cwiseProduct(v).colwise().sum();
  const VectorXd by_sum = -0.5 * by_factor.cwiseProduct(factors).cwiseQuotient(sums);
  const MatrixXd by_product = by_sum.asDiagonal() * products.cwiseSign();
  return gradient * factors.asDiagonal() + v * (by_product + by_product.transpose());
}

/// Returns (I + Z)^-1 of the Cayley transform, whose upper block is 2 (I + Z)^-1 - I. It exists since Z + Z' = 2 Y'Y.
MatrixXd cayley_inverse(const MatrixXd& v) {
  const Index columns = v.cols();
  const auto x = v.topRows(columns), y = v.bottomRows(v.rows() - columns);
  const MatrixXd z = x - x.transpose() + y.transpose() * y;
  return (MatrixXd::Identity(columns, columns) + z).inverse();
}

MatrixXd orthogonal(const MatrixXd& v) {
  if (v.rows() < v.cols()) return orthogonal(v.transpose()).transpose();
  const Index columns = v.cols();
  const MatrixXd inverse = cayley_inverse(v);
  MatrixXd q(v.rows(), columns);
  q.topRows(columns) = 2 * inverse - MatrixXd::Identity(columns, columns);
  q.bottomRows(v.rows() - columns) = -2 * v.bottomRows(v.rows() - columns) * inverse;
  return q;
}

MatrixXd orthogonal_pull_back(const MatrixXd& v, const MatrixXd& gradient) {
  if (v.rows() < v.cols()) return orthogonal_pull_back(v.transpose(), gradient.transpose()).transpose();
  const Index columns = v.cols(), rest = v.rows() - columns;
  const MatrixXd inverse = cayley_inverse(v);
  const auto y = v.bottomRows(rest), by_lower = gradient.bottomRows(rest);
  const MatrixXd by_inverse = 2 * gradient.topRows(columns) - 2 * y.transpose() * by_lower;
  const MatrixXd by_z = -inverse.transpose() * by_inverse * inverse.transpose();
  MatrixXd result(v.rows(), columns);
  result.topRows(columns) = by_z - by_z.transpose();
  result.bottomRows(rest) = -2 * by_lower * inverse.transpose() + y * (by_z + by_z.transpose());
  return result;
}

/// One layer of a sandwich parametrization.
struct Slice {
  MatrixXd v, k, c, a;
};

Slice slice_of(const MatrixXd& v) {
  const MatrixXd identity = MatrixXd::Identity(v.rows(), v.rows());
  Slice slice;
  slice.v = v;
  slice.k = (identity + v * v.transpose()).llt().solve(identity);
  slice.c = 2 * slice.k * v;
  slice.a = 2 * slice.k - identity;
  return slice;
}

/// Returns d loss / d v from the derivatives with respect to c and a.
MatrixXd slice_pull_back(const Slice& slice, const MatrixXd& by_c, const MatrixXd& by_a) {
  const MatrixXd by_k = 2 * by_c * slice.v.transpose() + 2 * by_a;
  const MatrixXd by_square = -slice.k * by_k * slice.k;
  return 2 * slice.k * by_c + (by_square + by_square.transpose()) * slice.v;
}

Contraction contraction_of(Layers layers) {
  return layers == Layers::kAol ? Contraction{aol, aol_pull_back}
                                : Contraction{orthogonal, orthogonal_pull_back};
}

}  // namespace

double slack_of_product(Layers layers, int count) {
  return layers == Layers::kSandwich ? std::ldexp(1, count - 1) : 1;
}

BoundedLayers::BoundedLayers(const Layout& layout, Layers layers, const files::GammaStatement& gamma)
    : layout_(&layout), layers_(layers), gamma_(gamma), shares_(layout.parts().size(), 1.0) {}

Eigen::MatrixXd BoundedLayers::matrix_of(const Vector& theta, int part, int layer) const {
  return layout_->weights(theta, part, layer).cast<double>();
}

double BoundedLayers::limit_of(int part) const {
  return shares_[part] * layer_limit(gamma_, layout_->parts()[part].layers());
}

Vector BoundedLayers::weights(const Vector& parameters) const {
  Vector theta = parameters;
  for (int p = 0; layers_ != Layers::kFree && p < static_cast<int>(layout_->parts().size()); ++p) {
    const double limit = limit_of(p);
    MatrixXd before;  // A of the previous layer
    for (int k = 0; k < layout_->parts()[p].layers(); ++k) {
      const MatrixXd v = matrix_of(parameters, p, k);
      if (layers_ != Layers::kSandwich) {
        layout_->weights(theta, p, k) = (limit * contraction_of(layers_).value(v)).cast<float>();
        continue;
      }
      Slice slice = slice_of(v);
      const MatrixXd w = k == 0 ? slice.c : MatrixXd(slice.c * before);
      layout_->weights(theta, p, k) = (limit * w).cast<float>();
      before = std::move(slice.a);
    }
  }
  return theta;
}

void BoundedLayers::pull_back(const Vector& parameters, Vector& gradient) const {
  for (int p = 0; layers_ != Layers::kFree && p < static_cast<int>(layout_->parts().size()); ++p) {
    if (layers_ == Layers::kSandwich) {
      pull_back_sandwich(parameters, p, gradient);
      continue;
    }
    for (int k = 0; k < layout_->parts()[p].layers(); ++k) {
      const MatrixXd by_w = limit_of(p) * matrix_of(gradient, p, k);
      layout_->weights(gradient, p, k) =
          contraction_of(layers_).pull_back(matrix_of(parameters, p, k), by_w).cast<float>();
    }
  }
}

void BoundedLayers::pull_back_sandwich(const Vector& parameters, int part, Vector& gradient) const {
  const int last = layout_->parts()[part].layers() - 1;
  Slice slice = slice_of(matrix_of(parameters, part, last));
  MatrixXd by_a = MatrixXd::Zero(slice.a.rows(), slice.a.cols());  // the last layer has no successor
  for (int k = last; k > 0; --k) {
    const MatrixXd by_w = limit_of(part) * matrix_of(gradient, part, k);
    Slice before = slice_of(matrix_of(parameters, part, k - 1));
    layout_->weights(gradient, part, k) = slice_pull_back(slice, by_w * before.a, by_a).cast<float>();
    by_a = slice.c.transpose() * by_w;
    slice = std::move(before);
  }
  const MatrixXd by_c = limit_of(part) * matrix_of(gradient, part, 0);
  layout_->weights(gradient, part, 0) = slice_pull_back(slice, by_c, by_a).cast<float>();
}

}  // namespace swarmcert::training
