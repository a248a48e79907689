#include "lipschitz/branch/rho_form.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <random>

#include "lipschitz/networks.h"
#include "nn/weights/weights.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::VectorXd;

/// Returns a rho with five inputs and two hidden layers of twelve neurons.
files::Network a_rho(std::uint32_t seed) {
  std::mt19937 random(seed);
  return tests::plain(tests::random_network({5, 12, 12, 2}, random));
}

TEST(RhoForm, NoTwoPointsOfRhoAreFurtherApartThanItsFormAllows) {
  for (const std::uint32_t seed : {1U, 2U, 3U}) {
    const files::Network network = a_rho(seed);
    const std::vector<check::Matrix> stages = check::stages(network, "network");
    const SdpBound joint = sdp_bound(stages);
    ASSERT_TRUE(joint.proof);
    const std::optional<RhoForm> form = rho_form(stages, joint.proof->t);
    ASSERT_TRUE(form);
    EXPECT_EQ(form->q, form->q.transpose());
    const files::Evaluator<double> rho(*network.plain);
    std::mt19937 random(seed + 100);
    double tightest = 0;
    for (int pair = 0; pair < 20000; ++pair) {
      std::vector<double> v(5), w(5);
      const double apart = pair % 2 == 0 ? 1e-3 : 3;
      for (std::size_t k = 0; k < v.size(); ++k) {
        v[k] = 3 * tests::random_number(random);
        w[k] = v[k] + apart * tests::random_number(random);
      }
      const std::vector<double> at_v = rho(v), at_w = rho(w);
      double moved = 0;
      for (std::size_t i = 0; i < at_v.size(); ++i) moved += (at_v[i] - at_w[i]) * (at_v[i] - at_w[i]);
      const VectorXd d = VectorXd::Map(v.data(), 5) - VectorXd::Map(w.data(), 5);
      const double allowed = d.dot(form->q * d);
      ASSERT_LE(moved, allowed * (1 + 1e-9)) << "seed " << seed << ", pair " << pair;
      tightest = std::max(tightest, moved / allowed);
    }
    EXPECT_GT(tightest, 0.2) << "no pair comes close to the form: the test shows nothing";
  }
}

TEST(RhoForm, WithTheJointMultipliersItGivesTheJointBound) {
  const files::Network network = a_rho(4);
  const std::vector<check::Matrix> stages = check::stages(network, "network");
  const SdpBound joint = sdp_bound(stages);
  ASSERT_TRUE(joint.proof);
  const std::optional<RhoForm> form = rho_form(stages, joint.proof->t);
  ASSERT_TRUE(form);
  // |rho(v) - rho(w)|^2 <= largest eigenvalue of Q |v - w|^2.
  const double largest = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(form->q).eigenvalues().maxCoeff();
  EXPECT_NEAR(std::sqrt(largest), tests::proved(joint), 1e-4 * tests::proved(joint));
}

TEST(RhoForm, ThereIsNoneForMultipliersThatProveNothing) {
  const files::Network network = a_rho(5);
  const std::vector<check::Matrix> stages = check::stages(network, "network");
  EXPECT_FALSE(rho_form(stages, std::vector<double>(24, 0.0)));
}

}  // namespace
}  // namespace swarmcert::lipschitz
