// %% [markdown]
// # 04 Compare with a flight
//
// Where is the model wrong? The residual is the part of the measured specific force that the model does not explain:
//
//     r = m a_specific - f_u - f_model        (a_specific: specific force in the world frame; f_u: thrust from PWM and battery)
//
// The flight is simulated: the truth has motor lag, downwash, drag and ground effect; the model has none of them.
//
// As commands:
//
// ```console
// $ fly='swarmcert simulate random-walk --vehicles 2 --duration 30 --gains controller/gains/crazyflie-small.toml'
// $ for run in 1 2 3; do $fly --model stability/models/crazyflie-small-effects.toml --seed $run -o flights/$run; done
// ...
// $ swarmcert compare stability/models/crazyflie-small.toml flights
// ...
// It fails at 0.2 .. 0.3 m below a vehicle, 0 .. 0.05 m beside its axis: 86.9 mN towards -z, 16 % of the mean square.
//   Mean residual along z [mN]
// ...
//   0.2 .. 0.3 m below a vehicle, 0 .. 0.05 m beside its axis:     -86.9  ################|
//   0.2 .. 0.3 m below a vehicle, 0.05 .. 0.1 m beside its axis:   -27.5             #####|
// ...
// ```
//
// The same from C++.

// %%
#include <fmt/format.h>

#include "analysis/residuals/failing_place.h"
#include "notebooks_cpp/flights.h"
#include "notebooks_cpp/notebook.h"

using namespace swarmcert;

int main() {
  notebook::simulate_flights("stability/models/crazyflie-small-effects.toml", 2, 2, 30, "flights");
  residuals::InputArguments arguments;
  arguments.models = {"stability/models/crazyflie-small.toml"};
  arguments.flights = {"flights"};
  const residuals::Inputs inputs = residuals::read_inputs(arguments);
  const residuals::Comparison comparison = residuals::compare(inputs, 0, [](int, int) {});

  // %%
  const residuals::ForceUnit mN = residuals::force_unit("N", inputs.models);
  const double per_N = mN.per_newton();
  const residuals::ErrorStatistics& all = comparison.overall.statistics;
  fmt::print("records {}\n", all.samples);
  fmt::print("RMSE (mN)  x {:.2f}  y {:.2f}  z {:.2f}\n", all.rmse.x * per_N, all.rmse.y * per_N,
             all.rmse.z * per_N);
  fmt::print("bias (mN)  x {:+.2f}  y {:+.2f}  z {:+.2f}\n", all.bias.x * per_N, all.bias.y * per_N,
             all.bias.z * per_N);

  // %% [markdown]
  // In which regions is it worst? Regions are ranges of height, speed, place of the neighbours and thrust.

  // %%
  for (std::size_t i = 0; i < 3 && i < comparison.regions.size(); ++i) {
    fmt::print("{:4.1f} % of the squared residual: {}\n", 100 * comparison.regions[i].share,
               residuals::region_words(comparison.regions[i], mN));
  }

  // %% [markdown]
  // The vertical residual of one vehicle over time, while the other one passes above.

  // %%
  std::string data;
  const residuals::TrackErrors& track = comparison.tracks.front();
  for (std::size_t i = 0; i < track.series.size(); i += 4) {
    data +=
        fmt::format("{:.2f} {:.2f}\n", track.series[i][0], static_cast<double>(track.series[i][3]) * per_N);
  }
  notebook::plot("residual", data,
                 "set xlabel 'time (s)'\nset ylabel 'vertical residual (mN)'\nset grid\n"
                 "plot 'residual.dat' using 1:2 with lines linecolor rgb '#0072b2' notitle\n");
}
