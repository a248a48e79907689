// Simulated flights that satisfy every hypothesis of a tube: none may leave it, and some must come close to its edge.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "analysis/tracking/tube/local_tube.h"
#include "tube/axes_flight.h"
#include "tube/scenes.h"

namespace swarmcert::analysis {
namespace {

/// Statistics of the flights in a tube.
struct Campaign {
  long looks = 0, outside = 0;
  double largest_share_z = 0;  ///< largest |e_z| relative to the tube's radius along z
  double nearest = 0;          ///< to the edge of a slice: 1 at the edge
};

/// Simulates the swap of two vehicles with random estimation errors, initial rotor states, prediction times and motor
/// lags of each vehicle, in the sampled loop of the gains that flew.
Campaign fly_in_tube(int flights, const EstimateErrors& estimates, const std::optional<Interval>& motor_lag_s,
                     const ResidualEnvelope* residual = nullptr) {
  const files::Network network = tests::demo_network();
  const stability::Model truth = tests::truth_model();
  const auto task = stability::make_task("swap", {2, 4.5, 0});
  const stability::FlownLoop loop = tests::loop_of("crazyflie-small");
  LocalTubeOptions options;
  options.estimates = estimates;
  options.motor_lag_s = motor_lag_s;
  options.residual = residual;
  const LocalTube tube = local_tube(loop, truth, network, *task, 2, options);
  Campaign campaign;
  EXPECT_TRUE(tube.proved && tube.is_sampled) << tube.why;
  if (!tube.proved) return campaign;
  tests::AxesFlight flight(loop, truth, network, *task, 2, true, estimates, motor_lag_s, residual);
  files::Random random(2026);
  const double radius_z_m = largest_position_m(tube.whole, 2);
  for (int i = 0; i < flights; ++i) {
    flight.fly(random, [&](double t, int vehicle, const std::array<double, 3>& e, const auto&) {
      const auto at = static_cast<std::size_t>(std::floor((t - 1e-9) / tube.slice_s));
      const Deviation& slice = tube.sliced.slices[at][static_cast<std::size_t>(vehicle)];
      for (std::size_t k = 0; k < 3; ++k) {
        const Interval range = slice.position_m[k];
        const double middle = (range.lower + range.upper) / 2;
        ++campaign.looks;
        if (!(e[k] >= range.lower && e[k] <= range.upper)) ++campaign.outside;
        // Movements of less than a tenth of a millimetre show only round-off.
        if (range.upper - range.lower > 1e-4)
          campaign.nearest = std::max(campaign.nearest, std::abs(e[k] - middle) / (range.upper - middle));
      }
      campaign.largest_share_z = std::max(campaign.largest_share_z, std::abs(e[2]) / radius_z_m);
    });
  }
  return campaign;
}

constexpr EstimateErrors kWrong{{0.003, 0.003, 0.003}, {0.0005, 0.0005, 0.0005}};

/// Ten per cent about the authors' identification.
const Interval kLags_s(0.9 * 0.0575, 1.1 * 0.0575);

/// @param nearest, share_z minimum that the flights must reach, of a slice's half-width and of the radius for |e_z|
void stay_inside(int flights, double nearest, double share_z,
                 const std::optional<Interval>& motor_lag_s = {}) {
  const Campaign campaign = fly_in_tube(flights, kWrong, motor_lag_s);
  EXPECT_EQ(campaign.looks, flights * 4500L * 2 * 3);
  EXPECT_EQ(campaign.outside, 0);
  EXPECT_GT(campaign.nearest, nearest);
  EXPECT_GT(campaign.largest_share_z, share_z);
}

TEST(FlightsInTube, NoneOfTwoHundredWithRandomLagsOfTheirMotorsLeavesIt) {
  stay_inside(200, 0.6, 0.2, kLags_s);
}

TEST(FlightsInTube, NoneOfAHundredWithAResidualThatJumpsBetweenTheEndsOfItsRangesLeavesIt) {
  ResidualEnvelope residual;
  residual.lowest_m = -1;
  residual.height_step_m = 0.1;
  residual.lateral_step_m = 0.05;
  residual.heights = 20;
  residual.laterals = 12;
  residual.cells.resize(residual.at(residual.heights, 0) + 1);
  for (std::size_t i = 0; i < residual.cells.size(); ++i) {
    const double middle_N = 0.0002 * static_cast<double>(i % 5);
    residual.cells[i].force_N.fill({middle_N - 0.0005, middle_N + 0.0005});
  }
  const int flights = 100;
  const Campaign campaign = fly_in_tube(flights, {}, {}, &residual);
  EXPECT_EQ(campaign.looks, flights * 4500L * 2 * 3);
  EXPECT_EQ(campaign.outside, 0);
  EXPECT_GT(campaign.nearest, 0.5);
}

TEST(FlightsInTube, NoneOfTenThousandWithRandomLagsLeavesIt_slow) { stay_inside(10000, 0.7, 0.2, kLags_s); }

}  // namespace
}  // namespace swarmcert::analysis
