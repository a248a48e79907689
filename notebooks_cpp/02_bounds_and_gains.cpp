// %% [markdown]
// # 02 Bounds and gains
//
// What tracking error will these gains give, if the learned force is wrong at a bounded rate?
//
//     s = e' + 2 Lambda e + Lambda^2 int e,   force = -K s,   |d(f_a - f_hat)/dt| <= d_m
//     limsup |e| <= d_m / (lambda_min(Lambda)^2 lambda_min(K))     the theorem's ball
//     sup |e|     = |h|_1 d_m                                      exact for a linear loop; h: step response of the error
//
// The theorem does not account for motor lag; the exact gain of the loop does.
//
// As commands:
//
// ```console
// $ model=stability/models/crazyflie-small.toml
// $ swarmcert bound --gains controller/gains/composite.toml --model $model --rate 0.3 --amplitude 0.1 --details
// ...
//   ball of the continuous loop, in the long run: 0.137868 m; of the loop that flies: 0.137868 m
// ...
//   z    command  continuous    0.137868  0.0995112          -          -  0.0866994  0.0867865  amplitude and rate
// ...
// $ swarmcert tune --gains controller/gains/crazyflie-small.toml --model $model --nodes 200
// ...
//   Kpos_P z                         10      18.0771     +80.8 %  1/s^2
//   Kpos_D z                          5      4.95221      -1.0 %  1/s
// ...
// active constraints: noise, lag_limit, rate
// ...
// ```
//
// The same from C++.

// %%
#include <fmt/format.h>

#include "notebooks_cpp/notebook.h"
#include "stability/bounds/loops/axis_loop.h"
#include "stability/bounds/theorem.h"
#include "stability/bounds/tracking_bounds.h"

using namespace swarmcert;

int main() {
  const double mass_kg = 0.034, rate_N_s = 0.3;
  const stability::Gains gains = stability::load_gains("controller/gains/composite.toml");
  const stability::Theorem theorem = stability::check_theorem({gains, {mass_kg}}, {});
  const stability::AxisLoop loop = *stability::FlownLoop{gains, {mass_kg}}.continuous(2);
  const double exact = stability::continuous_norms(loop, stability::Channel::kCommand).rate;
  fmt::print("theorem applies: {}\n", theorem.applies);
  fmt::print("its ball:        {:.4f} m\n", theorem.ball_per_rate() * rate_N_s);
  fmt::print("exact, one axis: {:.4f} m\n", exact * rate_N_s);

  // %% [markdown]
  // Without lag the theorem is sharp. Now Lambda and K are both scaled by c, and the force passes through a motor with a
  // time constant of 57 ms, the value found in published flights. Near the stability limit the loop leaves the ball: a lag
  // violates a hypothesis of the theorem, and `swarmcert bound` reports it.

  // %%
  std::string data;
  for (int step = 0; step <= 30; ++step) {
    const double c = 0.8 + 0.1 * step;
    stability::Gains both = gains;
    both.composite->Lambda_1_s = controller::scaled(c, both.composite->Lambda_1_s);
    both.composite->K_kg_s = controller::scaled(c, both.composite->K_kg_s);
    const double ball = stability::check_theorem({both, {mass_kg}}, {}).ball_per_rate() * rate_N_s;
    const double lag_limit = stability::lag_limit(*stability::FlownLoop{both, {mass_kg}}.continuous(2));
    both.motor_lag_s = 0.057;
    const stability::AxisLoop lagged = *stability::FlownLoop{both, {mass_kg}}.continuous(2);
    const double error = stability::continuous_norms(lagged, stability::Channel::kCommand).rate * rate_N_s;
    data += fmt::format("{:.2f} {:.4g} {:.4g}\n", c, 1000 * ball, 1000 * error);
    if (step % 10 == 0) {
      fmt::print("c = {:.1f}: ball {:6.2f} mm, with the lag {:6.2f} mm; stable up to {:3.0f} ms of lag\n", c,
                 1000 * ball, 1000 * error, 1000 * lag_limit);
    }
  }
  notebook::plot("gains", data,
                 "set xlabel 'scale c of Lambda and K (1)'\nset ylabel 'bound of the tracking error (mm)'\n"
                 "set logscale y\nset grid\n"
                 "plot 'gains.dat' using 1:2 with lines linewidth 2 linecolor rgb '#0072b2' title 'ball of "
                 "the theorem', "
                 "'' using 1:3 with lines linewidth 2 dashtype 2 linecolor rgb '#d55e00' title 'exact, with "
                 "motor lag'\n");
}
