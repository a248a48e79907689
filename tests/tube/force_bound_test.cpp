// Bounds of |f_hat - f_a| over a tube compared with states inside it.
#include "analysis/tracking/tube/force_bound.h"

#include <gtest/gtest.h>

#include <cmath>

#include "analysis/tracking/tube/force_constants.h"
#include "tube/forces.h"
#include "tube/scenes.h"

namespace swarmcert::analysis {
namespace {

using tests::between;
using tests::Forces;

Radii some_radii(int vehicles, double position_m, double velocity_m_s) {
  Radii radii = Radii::none(vehicles);
  for (auto& p : radii.position_m) p.fill(position_m);
  for (auto& v : radii.velocity_m_s) v.fill(velocity_m_s);
  return radii;
}

/// Random states in each stretch: the inputs of the network, and slightly later the state in which the truth acts.
/// @returns the largest ratio of error to bound
double largest_share(const Scene& scene, const files::Network& network, const stability::Model& truth,
                     const Radii& radii, const std::vector<double>& bounds, std::uint64_t seed) {
  Forces forces(network, truth);
  files::Random random(seed);
  double share = 0;
  for (std::size_t s = 0; s < bounds.size(); ++s) {
    const std::vector<Interval> states = scene.states(scene.motion().stretches[s], all_within(radii));
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

TEST(Enclosure, NoStateOfTheTubeExceedsItsBoundAndSomeComeNear) {
  const files::Network network = tests::demo_network();
  const stability::Model truth = tests::truth_model();
  const stability::FlownLoop loop = tests::loop_of("crazyflie-small");
  for (const Case& c : {Case{2, 0, 0}, Case{2, 0.04, 0.15}, Case{3, 0.01, 0.03}}) {
    const auto task = stability::make_task("swap", {c.vehicles, 4.5, 0});
    const Scene scene(loop, truth, network, *task, c.vehicles, 0.011);
    ASSERT_EQ(scene.refusal(), "");
    EnclosureOptions options;
    options.boxes = c.vehicles == 2 ? 6 : 1;
    Enclosure enclosure(scene, options);
    const Radii radii = some_radii(c.vehicles, c.position_m, c.velocity_m_s);
    ASSERT_TRUE(enclosure.prepare(radii, {}));
    const std::vector<double> bounds = enclosure.sizes(radii);
    const double share = largest_share(scene, network, truth, radii, bounds, 5);
    EXPECT_LE(share, 1) << c.vehicles << " " << c.position_m;
    EXPECT_GT(share, 0.4) << "bounds that no state comes near to would hide a fault";
    // A smaller tube within the prepared one: its bounds are smaller and hold.
    const Radii half = radii.scaled(0.5, 0);
    const std::vector<double> smaller = enclosure.sizes(half);
    for (std::size_t s = 0; s < smaller.size(); ++s) ASSERT_LE(smaller[s], bounds[s]);
    EXPECT_LE(largest_share(scene, network, truth, half, smaller, 6), 1);
    // Half of the bound must fail the same check, which shows that the test can detect errors.
    std::vector<double> broken = smaller;
    for (double& x : broken) x *= 0.4;
    EXPECT_GT(largest_share(scene, network, truth, half, broken, 6), 1);
  }
}

TEST(SlopeBound, NoStateOfTheTubeExceedsItAndBetterConstantsBoundBetter) {
  const files::Network network = tests::demo_network();
  const stability::Model truth = tests::truth_model();
  const stability::FlownLoop loop = tests::loop_of("crazyflie-small");
  const auto task = stability::make_task("swap", {2, 4.5, 0});
  const Scene scene(loop, truth, network, *task, 2, 0.011);
  Enclosure at_set_points(scene, {});
  const Radii none = Radii::none(2);
  ASSERT_TRUE(at_set_points.prepare(none, {}));
  const Radii radii = some_radii(2, 0.03, 0.1);
  const GlobalConstants global = global_constants(network, scene.learned(), nullptr);
  const std::vector<ForceConstants> local =
      local_constants(network, scene, radii, global, 15, 0, nullptr, nullptr);
  const std::vector<ForceConstants> product(2, global.product);
  const std::vector<ForceConstants> sdp(2, global.sdp);
  std::vector<std::vector<double>> all;
  for (const std::vector<ForceConstants>* constants : {&local, &sdp, &product}) {
    SlopeBound bound(scene, at_set_points.sizes(none), *constants);
    ASSERT_TRUE(bound.prepare(radii, scene.truth_sizes(radii)));
    all.push_back(bound.sizes(radii));
    EXPECT_LE(largest_share(scene, network, truth, radii, all.back(), 8), 1);
  }
  for (std::size_t s = 0; s < all[0].size(); ++s) {
    ASSERT_LE(all[0][s], all[1][s]);
    ASSERT_LE(all[1][s], all[2][s]);
  }
  EXPECT_LT(local[0].position, global.sdp.position)
      << "a box this small must be steeper nowhere near the global bound";
}

}  // namespace
}  // namespace swarmcert::analysis
