#include "nn/training/bounded_layers.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <cmath>

#include "nn/base/random.h"

namespace swarmcert::training {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// Layers that increase, keep and decrease the width, in parts of one layer and of four.
Layout layout_of_shapes() {
  return Layout({{"phi:small", {6, 9, 9, 7, 4}}, {"phi:ground", {4, 4}}, {"rho:small", {4, 8, 1}}});
}

Vector random_vector(Index size, double scale, std::uint64_t seed) {
  files::Random random(seed);
  Vector result(size);
  for (float& x : result) x = static_cast<float>(scale * random.symmetric());
  return result;
}

files::GammaStatement gamma_of(double value) {
  return {value, files::GammaStatement::Scope::kLayer, files::GammaStatement::Mode::kClip};
}

constexpr Layers kBounded[] = {Layers::kAol, Layers::kOrthogonal, Layers::kSandwich};

MatrixXd weights_of(const Layout& layout, const Vector& theta, int part, int layer) {
  return layout.weights(theta, part, layer).cast<double>();
}

/// Returns the smallest eigenvalue of the matrix of LipSDP-Neuron (Fazlyab et al. 2019, the last block by a Schur
/// complement),
///    [L^2 I, -W_1'; -W_1, 2 I, -W_2'; ...; -W_n, I],
/// with all multipliers one, both ends scaled to one, and the layers rescaled, which commutes with ReLU, such that
/// their product is unchanged and the outer two are smaller by a factor of sqrt(2). If it is nonnegative, L is a
/// Lipschitz bound.
double least_eigenvalue(const Layout& layout, const Vector& theta, int part, double lipschitz) {
  const std::vector<int>& sizes = layout.parts()[part].sizes;
  const std::size_t layers = sizes.size() - 1;
  Index size = 0;
  for (const int n : sizes) size += n;
  MatrixXd lmi = MatrixXd::Zero(size, size);
  const double per_layer =
      2 / std::pow(std::ldexp(lipschitz, static_cast<int>(layers) - 1), 1.0 / static_cast<double>(layers));
  Index at = 0;
  for (std::size_t k = 0; k <= layers; ++k) {
    const bool is_end = k == 0 || k == layers;
    lmi.block(at, at, sizes[k], sizes[k]).diagonal().setConstant(is_end ? 1 : 2);
    if (k == layers) break;
    const int ends = (k == 0 ? 1 : 0) + (k + 1 == layers ? 1 : 0);
    const MatrixXd w =
        per_layer * std::pow(0.5, 0.5 * ends) * weights_of(layout, theta, part, static_cast<int>(k));
    lmi.block(at + sizes[k], at, sizes[k + 1], sizes[k]) = -w;
    lmi.block(at, at + sizes[k], sizes[k], sizes[k + 1]) = -w.transpose();
    at += sizes[k];
  }
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(lmi).eigenvalues()(0);
}

TEST(BoundedLayers, KeepTheirBoundForAnyParameters) {
  const Layout layout = layout_of_shapes();
  int at_bound = 0;
  for (const Layers layers : kBounded) {
    BoundedLayers bounded(layout, layers, gamma_of(1.5));
    bounded.tighten({0.5, 1, 1});
    for (std::uint64_t seed = 0; seed < 60; ++seed) {
      const double scale = std::pow(10, static_cast<double>(seed % 6) - 3);
      const Vector theta = bounded.weights(random_vector(layout.size(), scale, seed));
      for (int p = 0; p < 3; ++p) {
        SCOPED_TRACE(testing::Message() << static_cast<int>(layers) << " " << scale << " part " << p);
        const double limit = p == 0 ? 0.75 : 1.5;
        const int count = layout.parts()[p].layers();
        if (layers == Layers::kSandwich) {
          const double bound = std::pow(limit, count) / slack_of_product(layers, count);
          const double least = least_eigenvalue(layout, theta, p, bound);
          EXPECT_GE(least, -1e-5);
          at_bound += least < 1e-3;
        }
        for (int k = 0; k < count; ++k) {
          const Eigen::VectorXd norms = weights_of(layout, theta, p, k).jacobiSvd().singularValues() / limit;
          EXPECT_LE(norms.maxCoeff(), 1 + 1e-5);
          if (layers == Layers::kOrthogonal) {
            EXPECT_GE(norms.minCoeff(), 1 - 1e-5);
          }
        }
      }
    }
  }
  EXPECT_GT(at_bound, 10) << "sandwiches come up to their bound";
}

TEST(BoundedLayers, SandwichesReachNetworksWhoseProductOfNormsIsAboveTheirBound) {
  // x| = relu(x) + relu(-x) has the Lipschitz constant 1, which LipSDP proves; the product of its layers' norms is 2.
  const Layout layout({{"phi:small", {1, 2, 1}}});
  Vector parameters = Vector::Zero(layout.size());
  layout.weights(parameters, 0, 0) << 1, -1;
  layout.weights(parameters, 0, 1) << 1, 1;
  const Vector theta = BoundedLayers(layout, Layers::kSandwich, gamma_of(std::sqrt(2.0)))
                           .weights(parameters / std::sqrt(2.0f));
  EXPECT_LT((weights_of(layout, theta, 0, 0) - Eigen::Vector2d(1, -1)).norm(), 1e-6);
  EXPECT_LT((weights_of(layout, theta, 0, 1) - Eigen::RowVector2d(1, 1)).norm(), 1e-6);
  EXPECT_GE(least_eigenvalue(layout, theta, 0, 1), -1e-6);
}

/// Compares with d (c' weights(parameters)) / d parameters by central differences of weights rounded to float32.
TEST(BoundedLayers, PullBackIsTheDerivativeInEveryParameter) {
  const Layout layout = layout_of_shapes();
  const Vector c = random_vector(layout.size(), 1, 3);
  for (const Layers layers : kBounded) {
    BoundedLayers bounded(layout, layers, gamma_of(1.7));
    bounded.tighten({0.9, 0.6, 1});
    Vector parameters = random_vector(layout.size(), 0.7, 5);
    Vector gradient = c;
    bounded.pull_back(parameters, gradient);
    const double tolerance = 2e-3 * static_cast<double>(gradient.cwiseAbs().maxCoeff());
    for (Index i = 0; i < layout.size(); ++i) {
      const float step = 0x1p-11f, before = parameters(i);  // few kinks of |V'V| are that close
      const auto value = [&](float x) {
        parameters(i) = x;
        return c.cast<double>().dot(bounded.weights(parameters).cast<double>());
      };
      const double derivative =
          (value(before + step) - value(before - step)) / (2 * static_cast<double>(step));
      parameters(i) = before;
      ASSERT_NEAR(static_cast<double>(gradient(i)), derivative, tolerance)
          << static_cast<int>(layers) << " parameter " << i;
    }
  }
}

}  // namespace
}  // namespace swarmcert::training
