// %% [markdown]
// # 08 Write your own effect
//
// The library does not know your physics: a soft net at the side of the flying space, say, that pushes back.
//
//     f_x = -k max(0, x - x0)         k in N/m, x0 in m
//
// An effect returns the force per unit of each coefficient, and states where it acts. The simulator and the identification
// use only these columns.
//
// As commands:
//
// ```console
// $ printf '%s\n' '[[effect]]' 'name = "net"' 'parameters = { k_N_m = 1.0, edge_m = 0.02 }' >net.toml
// $ printf '%s\n' '[effect.expression]' 'force_x_N = "-k_N_m * max(0, x - edge_m)"' 'linear = ["k_N_m"]' >>net.toml
// $ cat stability/models/crazyflie-small.toml net.toml >truth.toml
// $ fly='swarmcert simulate random-walk --duration 40 --gains controller/gains/crazyflie-small.toml'
// $ for run in 1 2 3; do $fly --vehicles 1 --model truth.toml --seed $run -o flights/$run; done
// ...
// $ sed 's/k_N_m = 1.0/k_N_m = 0.3/' truth.toml >guess.toml
// $ swarmcert add net --model guess.toml flights -o fitted.toml
// ...
//   nominal     10.74        12.44      13.01          1.78
//   + net        8.29         8.40       8.29          1.13
// ...
// net k_N_m = 0.9969, 90 % 0.9655 .. 1.034
// ...
// ```
//
// The same from C++.

// %%
#include <fmt/format.h>

#include <algorithm>

#include "analysis/identification/diagnose.h"
#include "analysis/residuals/force_residual.h"
#include "nn/base/file_io.h"
#include "notebooks_cpp/flights.h"
#include "notebooks_cpp/notebook.h"
#include "stability/effects/registry.h"

using namespace swarmcert;
using namespace swarmcert::stability;

class Net : public Effect {
 public:
  Net() : Effect(describe()) {}
  static EffectInfo describe() {
    return {"net",
            "f_x = -k max(0, x - x0)",
            "this guide",
            "net",
            "fly against it at several speeds",
            {{"stiffness_N_m", "k", 1, 0, 10}},
            {{"edge_m", "x0", 0.02, -1, 1, {-0.04, -0.02, 0, 0.02, 0.04}}}};
  }
  void columns(const Instant& now, const double* shape, Wrench* columns) const override {
    columns[0] = {{-std::max(0.0, now.p_W_m.x() - shape[0]), 0, 0}, Eigen::Vector3d::Zero()};
  }
  bool in_support(const Instant& now, const double* shape) const override { return now.p_W_m.x() > shape[0]; }
};

int main() {
  register_effect(Net::describe(),
                  [](const EffectSpec&, const EffectContext&) { return std::make_unique<Net>(); });

  // %% [markdown]
  // Model files may now name the effect. The truth includes it; the diagnosed model does not.

  // %%
  files::write_file("truth.toml",
                    files::read_file("stability/models/crazyflie-small.toml") +
                        "\n[[effect]]\nname = \"net\"\nparameters = { stiffness_N_m = 1.0, edge_m = 0.02 }\n",
                    true);
  notebook::simulate_flights("truth.toml", 1, 3, 40, "flights");
  residuals::InputArguments arguments;
  arguments.models = {"stability/models/crazyflie-small.toml"};
  arguments.flights = {"flights"};
  const residuals::Inputs inputs = residuals::read_inputs(arguments);
  for (const identification::Missing& one : identification::missing_effects(
           inputs, "small", identification::every_flight(inputs), 0, [](int, int) {})) {
    fmt::print("{}: RMSE {:.4f} -> {:.4f} N\n", one.effect, one.finding.rmse_before_N,
               one.finding.rmse_after_N);
    for (const auto& [name, value] : one.parameters) fmt::print("  {} = {:.3g}\n", name, value);
  }

  // %% [markdown]
  // The residual along x over x, with the true force.

  // %%
  std::vector<std::string> problems;
  std::string data;
  for (const residuals::Track& track : inputs.load(0, problems)) {
    const std::vector<Eigen::Vector3d> residual_N =
        residuals::force_residual(inputs.model_for(track), inputs.kinds, inputs.rules, track);
    for (std::size_t i = 0; i < residual_N.size(); i += 20) {
      if (track.cut[i] != residuals::Cut::kNone) continue;
      const double x_m = track.instants[i].p_W_m.x();
      data += fmt::format("{:.3f} {:.4f} {:.4f}\n", x_m, residual_N[i].x(), -std::max(0.0, x_m - 0.02));
    }
  }
  notebook::plot(
      "net", data,
      "set xlabel 'x (m)'\nset ylabel 'force along x (N)'\nset grid\n"
      "plot 'net.dat' using 1:2 with points pointtype 7 pointsize 0.4 linecolor rgb '#0072b2' title "
      "'residual', "
      "'' using 1:3 with points pointtype 7 pointsize 0.4 linecolor rgb '#d55e00' title 'truth'\n");
}
