// %% [markdown]
// # 06 Add it and watch the error fall
//
// Does the new model predict flights that it has not seen? Whole flights are assigned to the fit, to the selection of effects,
// and to a final test that influences nothing.
//
//     accepted if RMSE(select) falls by at least half a percent;   reported: RMSE(test)
//
// As commands:
//
// ```console
// $ fly='swarmcert simulate random-walk --vehicles 2 --duration 30 --gains controller/gains/crazyflie-small.toml'
// $ for run in 1 2 3; do $fly --model stability/models/crazyflie-small-effects.toml --seed $run -o flights/$run; done
// ...
// $ model=stability/models/crazyflie-small.toml
// $ swarmcert add downwash,motor_lag,drag_linear --model $model flights -o fitted.toml
// ...
//   + downwash        10.24        10.23      10.58          1.50
//   + motor_lag        7.63         7.68       7.62          1.08
//   + drag_linear      7.12         7.15       7.10          1.01
// ...
// $ swarmcert add undo --model fitted.toml -o before.toml
// ...
// Written: before.toml
// ```
//
// The same from C++.

// %%
#include <fmt/format.h>

#include "analysis/identification/ladder.h"
#include "nn/base/file_io.h"
#include "notebooks_cpp/flights.h"
#include "notebooks_cpp/notebook.h"

using namespace swarmcert;

int main() {
  notebook::simulate_flights("stability/models/crazyflie-small-effects.toml", 2, 5, 20, "flights");
  residuals::InputArguments arguments;
  arguments.models = {"stability/models/crazyflie-small.toml"};
  arguments.flights = {"flights"};
  const residuals::Inputs inputs = residuals::read_inputs(arguments);
  identification::LadderOptions options;
  options.automatic = false;
  options.effects = {"downwash", "motor_lag", "drag_linear"};
  const identification::Ladder ladder = identification::climb(inputs, options, 0, [](int, int) {});

  // %%
  std::string data;
  for (const stability::LadderRow& row : ladder.rows) {
    fmt::print("{:<12} fit {:.1f}  select {:.1f}  test {:.1f} mN  {}\n", row.effect, 1000 * row.fit_rmse_N,
               1000 * row.select_rmse_N, 1000 * row.test_rmse_N, row.accepted ? "" : row.note);
    data +=
        fmt::format("\"{}\" {:.2f} {:.2f} {:.2f}\n", row.effect == "nominal" ? row.effect : "+ " + row.effect,
                    1000 * row.fit_rmse_N, 1000 * row.test_rmse_N, 1000 * row.noise_floor_N);
  }
  notebook::plot("ladder", data,
                 "set style data linespoints\nset yrange [0:*]\nset grid y\nset ylabel 'RMSE of the force "
                 "residual (mN)'\n"
                 "plot 'ladder.dat' using 0:2:xtic(1) linecolor rgb '#0072b2' title 'flights of the fit', "
                 "'' using 0:3 linecolor rgb '#d55e00' title 'test flights', "
                 "'' using 0:4 with lines dashtype 2 linecolor rgb '#999999' title 'noise floor'\n");

  // %% [markdown]
  // The new model is a file that every command reads; it records its own history.

  // %%
  files::write_file("fitted.toml", stability::to_toml(ladder.model), true);
  for (const stability::EffectSpec& effect : stability::read_model("fitted.toml").effects) {
    for (const auto& [name, value] : effect.parameters)
      fmt::print("{}.{} = {:.3g}\n", effect.name, name, value);
  }
}
