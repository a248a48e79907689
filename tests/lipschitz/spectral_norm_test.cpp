#include "lipschitz/spectral_norm.h"

#include <Eigen/Dense>

#include "data.h"
#include "lipschitz/networks.h"

namespace swarmcert {
namespace {

using lipschitz::spectral_norm;
using lipschitz::SpectralNorm;

TEST(SpectralNorm, EnclosesTheSingularValueOfRandomMatricesNarrowly) {
  std::mt19937 generator(1);
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  for (int round = 0; round < 30; ++round) {
    const int rows = 1 + static_cast<int>(generator() % 40);
    const int cols = 1 + static_cast<int>(generator() % 40);
    const files::Layer layer = tests::random_network({cols, rows}, generator).layers[0];
    const SpectralNorm norm = spectral_norm(layer);
    const double svd =
        Eigen::Map<const RowMajor>(layer.weights.data(), rows, cols).jacobiSvd().singularValues()(0);
    EXPECT_LT(norm.norm.lower.value(), norm.norm.upper.value() + 1e-300);
    EXPECT_NEAR(norm.norm.lower.value(), svd, 1e-13 * svd);
    EXPECT_NEAR(norm.norm.upper.value(), svd, 2e-12 * svd);
  }
}

TEST(SpectralNorm, PublishedFloat32LayersExceedTheDeclaredThree) {
  SWARMCERT_NEEDS_DATA();
  // 3.000000066 and 3.000000104: the project's reference measurements.
  for (const auto& [file, value] :
       {std::pair("phi_L.pth", 3.000000066348642), std::pair("rho_S.pth", 3.000000103595477)}) {
    const files::Weights net = files::load_weights(tests::data_path(std::string("weights/zip_f32/") + file));
    const SpectralNorm norm = spectral_norm(net.layers[1], 3.0);
    EXPECT_GT(norm.norm.lower.value(), 3.0) << file;
    EXPECT_NEAR(norm.norm.lower.value(), value, 1e-13) << file;
  }
}

TEST(SpectralNorm, ANormThatEqualsTheLimitIsProvedEqual) {
  const files::Layer scaled_permutation = tests::layer(3, 3, {0, 3, 0, 0, 0, -3, 3, 0, 0});
  const SpectralNorm norm = spectral_norm(scaled_permutation, 3.0);
  EXPECT_EQ(norm.norm.lower.value(), 3.0);
  EXPECT_EQ(norm.norm.upper.value(), 3.0);
}

TEST(SpectralNorm, VeryLargeAndVerySmallWeightsAreEnclosed) {
  for (const double scale : {1e150, 1e-150}) {
    const SpectralNorm norm = spectral_norm(tests::layer(2, 2, {3 * scale, 0, 0, 4 * scale}));
    EXPECT_LE(norm.norm.lower.value(), 4 * scale);
    EXPECT_GE(norm.norm.upper.value(), 4 * scale);
    EXPECT_LE(norm.norm.upper.value(), 4.0000001 * scale);
  }
}

TEST(SpectralNorm, OfAZeroMatrixIsBelowAnythingThatMatters) {
  const SpectralNorm norm = spectral_norm(tests::layer(2, 3, std::vector<double>(6, 0.0)));
  EXPECT_EQ(norm.norm.lower.value(), 0);
  EXPECT_LE(norm.norm.upper.value(), 1e-150);
}

TEST(SpectralNorm, OneEntryIsItsMagnitude) {
  const SpectralNorm norm = spectral_norm(tests::layer(1, 1, {-0.1}));
  EXPECT_EQ(norm.norm.lower.value(), 0.1);
  EXPECT_NEAR(norm.norm.upper.value(), 0.1, 1e-15);
}

TEST(SpectralNorm, ProductsAreRoundedUp) {
  using lipschitz::UpperBound;
  const double product = lipschitz::product_up({UpperBound(0.1), UpperBound(0.1)}).value();
  EXPECT_GE(mpq_class(product), mpq_class(0.1) * mpq_class(0.1));
  EXPECT_NEAR(product, 0.01, 1e-17);
}

TEST(SpectralNorm, RefusesNonFiniteWeights) {
  EXPECT_THROW(spectral_norm(tests::layer(1, 1, {std::nan("")})), std::invalid_argument);
}

}  // namespace
}  // namespace swarmcert
