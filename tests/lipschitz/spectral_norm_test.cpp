#include "lipschitz/upper/spectral_norm.h"

#include <Eigen/Dense>

#include "data.h"
#include "lipschitz/certify.h"
#include "lipschitz/networks.h"
#include "nn/refusal.h"

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

TEST(SpectralNorm, EnclosesTheNormOfTheSmallestNumbers) {
  for (const double tiny : {5e-324, 1e-310, 1e-300}) {
    const SpectralNorm norm = spectral_norm(tests::layer(1, 2, {tiny, 0}));
    EXPECT_LE(norm.norm.lower.value(), tiny);
    EXPECT_GE(norm.norm.upper.value(), tiny);
  }
}

TEST(SpectralNorm, WeightsWhoseSlopesLeaveTheRangeOfDoubleAreRefusedByName) {
  const auto network = [](double first, double bias, double second) {
    files::Weights weights =
        tests::weights({tests::layer(2, 2, {first, 0, 0, 1}), tests::layer(1, 2, {second, 1})});
    weights.layers[1].biases[0] = bias;
    return tests::plain(weights);
  };
  EXPECT_NO_THROW(lipschitz::require_moderate(network(1e70, 1e100, 1e70)));
  EXPECT_NO_THROW(lipschitz::require_moderate(network(1e-300, 0, 5e-324)));
  const auto refused = [&](double first, double bias, double second, const std::string& field) {
    return tests::refuses([&] { lipschitz::require_moderate(network(first, bias, second)); },
                          {"made by a test", field, "is too large"});
  };
  EXPECT_TRUE(refused(1e300, 0, 1, "fc1.weight"));
  EXPECT_TRUE(refused(1, 0, -1e300, "fc2.weight"));
  EXPECT_TRUE(refused(1, 1e300, 1, "fc2.bias"));
  EXPECT_TRUE(refused(1e100, 0, 1e100, "fc2.weight"));
  EXPECT_TRUE(
      tests::refuses([&] { lipschitz::certify(network(1e300, 0, 1), {}); }, {"fc1.weight", "1e+300"}));
}

TEST(SpectralNorm, RefusesNonFiniteWeights) {
  EXPECT_THROW(spectral_norm(tests::layer(1, 1, {std::nan("")})), std::invalid_argument);
}

}  // namespace
}  // namespace swarmcert
