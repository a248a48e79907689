#include "stability/simulation/float_errors.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "data.h"
#include "nn/base/file_io.h"
#include "nn/temp_folder.h"
#include "stability/bounds/tracking_bounds.h"
#include "stability/simulation/sampled_flight.h"
#include "stability/tasks/task.h"

namespace swarmcert::stability {
namespace {

constexpr char kModel[] = "stability/models/crazyflie-small.toml";

FlownLoop setup_with(const std::string& position_gains) {
  const tests::TempFolder folder;
  const std::string gains = folder / "gains.toml";
  files::write_file(
      gains, "schema = \"swarmcert/gains/1\"\n[position]\n" + position_gains + "rate_hz = 500\n", false);
  return load_flown_loop(gains, tests::source_path(kModel));
}

FloatErrors errors_of(const FlownLoop& setup) { return float_errors(setup, tracking_bounds(setup, {}, {})); }

TEST(FloatErrors, BoundHowFarAFlightInFloatDepartsFromTheSameInDouble) {
  const FlownLoop setup = setup_with("Kp = 10\nKd = 5\nKi = 10\nintegrator_limit = 0.1\n");
  const FloatErrors errors = errors_of(setup);
  ASSERT_TRUE(errors.applies) << errors.why_not;
  const auto task = make_task("hover", {1, 20, 0});
  Swarm swarms[] = {Swarm(setup.model, 1), Swarm(setup.model, 1)};
  SampledFlightOptions options[2];
  options[1].flies_float = false;
  SampledFlight in_float(swarms[0], setup.gains, *task, options[0]);
  SampledFlight in_double(swarms[1], setup.gains, *task, options[1]);
  double largest_m = 0;
  while (in_double.time_s() < 20) {
    in_float.step();
    in_double.step();
    largest_m = std::max(largest_m, std::abs(in_float.state()[2] - in_double.state()[2]));
  }
  EXPECT_GT(largest_m, 0) << "float must make a difference";
  EXPECT_LE(largest_m, errors.tracking_error_m[2]);
  EXPECT_LT(errors.tracking_error_m[2], 1e-3) << "a bound that is worth something";
}

TEST(FloatErrors, NothingIsSaidOfALoopThatNoGainBounds) {
  const FloatErrors errors = errors_of(setup_with("Kp = 10\nKd = 0.01\nKi = 30\n"));  // Kp Kd < Ki: unstable
  for (const double error_m : errors.tracking_error_m) EXPECT_TRUE(std::isinf(error_m));
}

}  // namespace
}  // namespace swarmcert::stability
