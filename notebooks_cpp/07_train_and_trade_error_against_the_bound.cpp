// %% [markdown]
// # 07 Train and trade error against the bound
//
// What does a smaller Lipschitz bound cost in accuracy? Every layer is trained under
//
//     |W_k| <= gamma       so that  L <= gamma^K  for K layers,  and LipSDP proves a smaller bound
//
// A small gamma gives a slowly changing prediction that misses the jet, a large gamma the reverse.
//
// As commands:
//
// ```console
// $ fly='swarmcert simulate random-walk --vehicles 2 --duration 30 --gains controller/gains/crazyflie-small.toml'
// $ for run in 1 2 3; do $fly --model stability/models/crazyflie-small-effects.toml --seed $run -o flights/$run; done
// ...
// $ model=stability/models/crazyflie-small.toml
// $ train='--phi 16,16 --rho 16 --features 8 --epochs 8 --rate 1e-2'
// $ swarmcert train $model flights $train -o free
// ...
// all                                            1.947             1.788
// ...
// Lipschitz constant of set:small:small: at most 1.9868213 gf per unit of input, proved
// ...
// $ swarmcert train $model flights $train --max-lipschitz 2 -o limited
// ...
// all                                            1.947             1.811
// ...
// Lipschitz constant of set:small:small: at most 1.3691547 gf per unit of input, proved
// ...
// Lipschitz constants at most 2: proved
// ...
// ```
//
// The same from C++.

// %%
#include <fmt/format.h>

#include "analysis/learning/projection.h"
#include "analysis/learning/training_run.h"
#include "lipschitz/certify.h"
#include "notebooks_cpp/flights.h"
#include "notebooks_cpp/notebook.h"

using namespace swarmcert;

/// The trained vector of parameters as the network that certify() takes.
files::Network network_of(const learning::LearningData& data, const training::Vector& theta) {
  files::Network network;
  for (std::size_t part = 0; part < data.layout.parts().size(); ++part) {
    const files::FunctionId& id = data.layout.parts()[part].id;  // "phi:small"
    auto& group = id.is_phi() ? network.phi : network.rho;
    group[id.kind()] = data.layout.stored(theta, static_cast<int>(part));
  }
  return network;
}

int main() {
  notebook::simulate_flights("stability/models/crazyflie-small-effects.toml", 2, 5, 30, "flights");
  residuals::InputArguments arguments;
  arguments.models = {"stability/models/crazyflie-small.toml"};
  arguments.flights = {"flights"};
  const residuals::Inputs inputs = residuals::read_inputs(arguments);
  const learning::NetworkSizes sizes{{16, 16}, {16}, 8, true};
  const learning::LearningData data =
      learning::load_learning_data({&inputs}, sizes, learning::SplitBy::kAuto, 0, [](int, int) {});
  fmt::print("{} samples; predicting nothing leaves {:.2f} gf on the test flights\n", data.tracks.back().end,
             learning::rmse_of_nothing(data, learning::Use::kTest));

  // %%
  std::string rows;
  for (const double gamma : {1.0, 1.5, 2.0, 3.0, 4.0}) {
    learning::RunOptions options;
    options.epochs = 16;
    options.patience = 16;
    options.trainer.batch = 128;
    options.trainer.learning_rate = 4e-3;
    options.trainer.gamma.value = gamma;
    const learning::Run run = learning::run_training(data, options);
    const double error_gf = learning::rmse(data, run.theta, learning::Use::kTest, 0);
    lipschitz::CertifyOptions certify_options;
    certify_options.lower.rounds = 0;
    const lipschitz::Certification found = lipschitz::certify(network_of(data, run.theta), certify_options);
    for (const lipschitz::CertifiedBound& bound : found.bounds) {
      if (bound.function != "set:small:small") continue;
      fmt::print(
          "gamma {:.1f}: test RMSE {:.2f} gf, proved L <= {:.4g} gf/(m, m/s), product of norms {:.4g}\n",
          gamma, error_gf, bound.upper.value(), bound.product.value());
      rows += fmt::format("{:.1f} {:.2f} {:.4g}\n", gamma, error_gf, bound.upper.value());
    }
  }
  notebook::plot("trade", rows,
                 "set logscale x\nset grid\nset xlabel 'proved Lipschitz bound of the set (gf per m, m/s)'\n"
                 "set ylabel 'test RMSE (gf)'\nset offsets graph 0.1, graph 0.1, graph 0.1, graph 0.1\n"
                 "plot 'trade.dat' using 3:2 with linespoints pointtype 7 linecolor rgb '#0072b2' notitle, "
                 "'' using 3:2:1 with labels offset 0,1 notitle\n");
}
