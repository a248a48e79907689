// %% [markdown]
// # 05 Find the missing effect
//
// Which physics does the model lack? Every effect of the library is linear in its coefficients c and nonlinear in its
// shape parameters theta, and the fit uses the same columns X_k as the simulator:
//
//     r(t) = sum_k c_k X_k(t; theta) + noise,      c within physical bounds, theta from a small grid
//
// An effect counts if it lowers the error of flights that are not part of the fit, is significant against the scatter between
// blocks of 2 s, and is confirmed by instrumental variables made from the setpoints.
//
// As commands:
//
// ```console
// $ fly='swarmcert simulate random-walk --vehicles 2 --duration 30 --gains controller/gains/crazyflie-small.toml'
// $ for run in 1 2 3; do $fly --model stability/models/crazyflie-small-effects.toml --seed $run -o flights/$run; done
// ...
// $ swarmcert diagnose stability/models/crazyflie-small.toml flights
// ...
//   downwash        RMSE 22.62 -> 10.48 mN (53.7 %, 90 %: 46.7 .. 59.9)
// ...
//   motor_lag       RMSE 10.48 -> 7.704 mN (26.5 %, 90 %: 24.4 .. 28.5)
// ...
//   Left: 7.161 mN (noise 7.02); nothing stands out.
// ...
// ```
//
// The same from C++.

// %%
#include <fmt/format.h>

#include "analysis/identification/diagnose.h"
#include "notebooks_cpp/flights.h"
#include "notebooks_cpp/notebook.h"

using namespace swarmcert;

int main() {
  notebook::simulate_flights("stability/models/crazyflie-small-effects.toml", 2, 3, 30, "flights");
  residuals::InputArguments arguments;
  arguments.models = {"stability/models/crazyflie-small.toml"};
  arguments.flights = {"flights"};
  const residuals::Inputs inputs = residuals::read_inputs(arguments);
  const std::vector<identification::Missing> missing = identification::missing_effects(
      inputs, "small", identification::every_flight(inputs), 0, [](int, int) {});

  // %%
  std::string data;
  for (const identification::Missing& one : missing) {
    const identification::Finding& finding = one.finding;
    const double drop = 100 * (1 - finding.rmse_after_N / finding.rmse_before_N);
    fmt::print("{:<12} RMSE {:.1f} -> {:.1f} mN, {:.0f} % less (90 %: {:.0f} .. {:.0f})\n", one.effect,
               1000 * finding.rmse_before_N, 1000 * finding.rmse_after_N, drop,
               100 * finding.drop_interval.lower, 100 * finding.drop_interval.upper);
    data += fmt::format("{} {:.1f} {:.1f} {:.1f}\n", one.effect, drop, 100 * finding.drop_interval.lower,
                        100 * finding.drop_interval.upper);
  }

  // %% [markdown]
  // The estimates. Simulated were tau = 0.0575 s and drag = 0.013 N s/m.

  // %%
  for (const identification::Missing& one : missing) {
    for (const auto& [name, interval] : one.intervals) {
      fmt::print("{}.{} = {:.3g} (90 %: {:.3g} .. {:.3g})\n", one.effect, name, one.parameters.at(name),
                 interval.lower, interval.upper);
    }
  }
  notebook::plot(
      "drops", data,
      "set offsets 0.3, 0.3, 0, 0\nset style fill solid 0.8\nset yrange [0:*]\nset grid y\n"
      "set ylabel 'fall of the RMSE (%), with 90 % interval'\nset errorbars linecolor rgb '#000000'\n"
      "plot 'drops.dat' using 0:2:3:4:(0.6):xtic(1) with boxerrorbars linecolor rgb '#0072b2' notitle\n");
}
