// Enclosures of f_hat - f_a over a tube compared with states inside it.
#include "analysis/tracking/tube/force_difference.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tube/forces.h"
#include "tube/scenes.h"

namespace swarmcert::analysis {
namespace {

using tests::between;
using tests::Forces;

Deviations within(int vehicles, double position_m, double velocity_m_s) {
  Deviation one;
  one.position_m.fill({-position_m, position_m});
  one.velocity_m_s.fill({-velocity_m_s, velocity_m_s});
  return Deviations(static_cast<std::size_t>(vehicles), one);
}

/// Random states in each stretch: the inputs of the network, and slightly later the state in which the truth acts.
/// @returns the largest ratio of error to bound
double largest_share(const Scene& scene, const files::Network& network, const stability::Model& truth,
                     const Deviations& deviations, const std::vector<double>& bounds, std::uint64_t seed) {
  Forces forces(network, truth);
  files::Random random(seed);
  double share = 0;
  for (std::size_t s = 0; s < bounds.size(); ++s) {
    const std::vector<Interval> states = scene.states(scene.motion().stretches[s], deviations);
    for (int i = 0; i < 60; ++i) {
      std::vector<double> seen, now;
      for (const Interval& x : states)
        seen.push_back(i % 2 == 0 ? (random.below(2) == 0 ? x.lower : x.upper)
                                  : between(random, x.lower, x.upper));
      now = seen;
      const double age_s = between(random, 0, scene.network_age_s());
      for (int n = 0; n + 1 < scene.vehicles(); ++n) {
        for (int k = 0; k < 3; ++k) {
          const auto at = static_cast<std::size_t>(n * kPerNeighbour + k);
          now[at] += age_s * between(random, states[at + 3].lower, states[at + 3].upper);
        }
      }
      const double learned = forces.learned(forces.at(seen, scene.vehicles() - 1));
      const double error = std::abs(learned - forces.truth(forces.at(now, scene.vehicles() - 1)).z());
      share = std::max(share, error / bounds[s]);
    }
  }
  return share;
}

struct Case {
  int vehicles;
  double position_m, velocity_m_s;
};

TEST(ForceDifference, NoStateOfTheTubeExceedsItsBoundAndSomeComeNear) {
  const files::Network network = tests::demo_network();
  const stability::Model truth = tests::truth_model();
  const stability::FlownLoop loop = tests::loop_of("crazyflie-small");
  for (const Case& c : {Case{2, 0, 0}, Case{2, 0.04, 0.15}, Case{3, 0.01, 0.03}}) {
    const auto task = stability::make_task("swap", {c.vehicles, 4.5, 0});
    const Scene scene(loop, truth, network, *task, c.vehicles, 0.011);
    ASSERT_EQ(scene.refusal(), "");
    const Deviations all = within(c.vehicles, c.position_m, c.velocity_m_s);
    // A smaller tube within the prepared one: its bounds are smaller and hold.
    const Deviations half = within(c.vehicles, c.position_m / 2, c.velocity_m_s / 2);
    std::vector<double> bounds, smaller;
    for (const Stretch& stretch : scene.motion().stretches) {
      ForceDifference difference(scene, stretch, all);
      difference.refine(c.vehicles == 2 ? 6 : 1, 1e-3, nullptr);
      bounds.push_back(difference.over(all).mag());
      smaller.push_back(difference.over(half).mag());
      ASSERT_LE(smaller.back(), bounds.back());
    }
    const double share = largest_share(scene, network, truth, all, bounds, 5);
    EXPECT_LE(share, 1) << c.vehicles << " " << c.position_m;
    EXPECT_GT(share, 0.4) << "bounds that no state comes near to would hide a fault";
    EXPECT_LE(largest_share(scene, network, truth, half, smaller, 6), 1);
    // Less than half of the bound must fail the same check, which shows that the test can detect errors.
    std::vector<double> broken = smaller;
    for (double& x : broken) x *= 0.4;
    EXPECT_GT(largest_share(scene, network, truth, half, broken, 6), 1);
  }
}

}  // namespace
}  // namespace swarmcert::analysis
