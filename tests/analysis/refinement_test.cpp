/// Refined shape parameters and their intervals do not depend on round-off.
#include "analysis/identification/refinement.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>

#include "analysis/identification/diagnose.h"
#include "data.h"
#include "hidden_effect/other_simulator.h"

namespace swarmcert::tests {
namespace {

/// Two flights of two vehicles that disturb each other.
class Refinements : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(testing::TempDir()) / ("refinement-" + std::to_string(getpid()));
    for (int run = 0; run < 2; ++run)
      fly({}, {Program::kRich, 2, 20, static_cast<std::uint64_t>(run)}, folder_.string(), run);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  /// The downwash, refined against a model of this mass.
  identification::Refined refined(double mass_kg) const {
    residuals::InputArguments arguments;
    arguments.models = {source_path("stability/models/crazyflie-small.toml")};
    arguments.flights = {folder_.string()};
    residuals::Inputs inputs = residuals::read_inputs(arguments);
    inputs.models[0].mass_kg = mass_kg;
    const identification::Coverage covered =
        identification::coverage(inputs, "small", identification::every_flight(inputs), 2);
    const identification::Passes passes = {
        inputs, "small", identification::every_flight(inputs), covered.records, 2, [](int, int) {}, nullptr};
    const identification::Candidate downwash =
        identification::candidate("downwash", inputs.models[0], covered);
    return refine(passes, {{downwash, downwash.thetas[downwash.thetas.size() / 2]}}).at(0);
  }

  std::filesystem::path folder_;
};

TEST_F(Refinements, StayWhereTheyAreWhenTheMassMovesByItsRounding) {
  constexpr double kMass_kg = 0.034, kRelative = 1e-6;
  const identification::Refined at = refined(kMass_kg);
  double mass_kg = kMass_kg;
  int moved = 0;
  for (int step = 0; step < 6; ++step) {
    mass_kg = std::nextafter(mass_kg, 1.0);
    const identification::Refined beside = refined(mass_kg);
    for (std::size_t i = 0; i < at.theta.size(); ++i) {
      EXPECT_NEAR(beside.theta[i], at.theta[i], kRelative * std::abs(at.theta[i])) << step;
      const double upper = at.shape_intervals[i].upper;
      EXPECT_NEAR(beside.shape_intervals[i].upper, upper, kRelative * std::abs(upper)) << step;
      moved += beside.theta[i] != at.theta[i] ? 1 : 0;
    }
  }
  EXPECT_GT(moved, 0) << "no last bit changed: this test shows nothing";
}

}  // namespace
}  // namespace swarmcert::tests
