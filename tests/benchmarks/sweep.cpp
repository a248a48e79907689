// Cells of a sweep: the loop that flies, at its rate, against the same cells without a rate, whose loop is continuous.
//   sweep [STEPS]: STEPS^2 cells (default 60)
#include <fmt/core.h>

#include <cmath>
#include <cstdlib>
#include <ctime>

#include "stability/sweep/grid.h"

namespace {

using namespace swarmcert::stability;

std::vector<double> from_to(double from, double to, int steps) {
  std::vector<double> values;
  for (int i = 0; i < steps; ++i) values.push_back(from * std::pow(to / from, i / (steps - 1.0)));
  return values;
}

Grid grid_of(double rate_hz, int steps, std::vector<std::string> compute) {
  const std::string folder = SWARMCERT_SOURCE_DIR;
  Grid grid;
  grid.gains = load_gains(folder + "/controller/gains/crazyflie-small.toml");
  grid.gains.rate_hz = rate_hz;
  grid.gains.integrator_step_s = rate_hz > 0 ? 1 / rate_hz : 0;
  grid.model = read_model(folder + "/stability/models/crazyflie-small.toml");
  grid.axes = {{"Kp", from_to(2, 40, steps)}, {"Kd", from_to(0.5, 20, steps)}};
  grid.compute = std::move(compute);
  grid.disturbance.amplitude_N = 0.02;
  return grid;
}

/// Returns seconds of processor time for all cells, which other programs disturb less than the time that passes.
double time_of(const Grid& grid, long& feasible) {
  const std::clock_t start = std::clock();
  feasible = 0;
  for (long i = 0; i < grid.cells(); ++i) feasible += compute_cell(grid, i).infeasible.empty() ? 1 : 0;
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

}  // namespace

int main(int argc, char** argv) {
  const int steps = argc > 1 ? std::atoi(argv[1]) : 60;
  const std::vector<std::vector<std::string>> quantities = {
      {"amplitude"}, {"amplitude", "impulse", "error_m", "effort", "lag_limit_s"}};
  fmt::print("{} cells\n", steps * steps);
  for (const std::vector<std::string>& compute : quantities) {
    long flown = 0, continuous = 0;
    const double sampled_s = time_of(grid_of(500, steps, compute), flown);
    const double continuous_s = time_of(grid_of(0, steps, compute), continuous);
    fmt::print(
        "{} quantities: {:.2f} s sampled ({} feasible), {:.2f} s continuous ({} feasible), ratio {:.2f}\n",
        compute.size(), sampled_s, flown, continuous_s, continuous, sampled_s / continuous_s);
  }
}
