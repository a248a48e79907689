// %% [markdown]
// # 09 Reproducing the paper
//
// `swarmcert reproduce EXPERIMENT -o DIR` repeats the table and figures of the paper (Shi et al.,
// *Neural-Swarm*, ICRA 2020) in simulation and on the published flights, and adds some experiments. Each
// run writes a report, its plots with their data, and `result.json`. Results are shown as found, with their
// seeds. By default an experiment has the small size that also runs in the tests; `--full` flies a minute per
// task and uses more seeds, `--shard i/N` divides the work.

// %%
#include <fmt/format.h>

#include "analysis/reproduction/experiments.h"
#include "notebooks_cpp/notebook.h"

using namespace swarmcert::reproduction;

int main() {
  for (const Experiment& one : experiments()) fmt::print("{:<16}{}\n", one.name, one.summary);

  // %% [markdown]
  // ## Two truths
  //
  // A simulation needs a true downwash, which the paper does not state. Every experiment therefore flies two:
  // one whose parameters all come from recorded flights, and one that is calibrated so that the errors
  // *without* a network match the paper's table. Their results are never mixed.

  // %%
  Setting setting;
  setting.models = "stability/models";
  for (const Truth& truth : truths(setting)) {
    fmt::print("{:<11} {} knob(s) chosen to match the table\n", truth.name, truth.knobs.size());
    for (const std::string& knob : truth.knobs) fmt::print("            {}\n", knob);
  }

  // %% [markdown]
  // ## What was found
  //
  // Largest vertical error in metres at small size, seed 1, truth from recorded flights; the paper's values
  // in brackets.
  //
  // | vehicles | without a network | trained with two | trained with as many |
  // |---|---|---|---|
  // | 2 | 0.088 (0.094) | 0.027 (0.027) | |
  // | 4 | 0.154 (0.209) | 0.117 (0.294) | 0.042 (0.102) |
  // | 5 | 0.195 (0.314) | | trained with three: 0.085 (0.159) |
  //
  // Networks trained with three or four vehicles divide the worst error of every swarm by at least 2.3
  // (calibrated truth: 3.1). In the paper, a network trained with two vehicles increases the error of four;
  // here it decreases it by a factor of 1.3 to 1.9. Vehicles fly 0.3 m above the published heights, where the
  // floor would otherwise limit the errors.
  //
  // `reproduce claims --full` tests under which conditions, which the paper does not state, three of its results appear.
  // Wakes are composed by a p-norm: p = 1 adds them up, a large p keeps the strongest. Medians over three training
  // seeds and five flights each, seed 1; results for batteries of 4.1 and 3.1 V and for both heights differ only where stated.
  //
  // | p | baseline, five vehicles over two | error of four without a network over that with one trained on two | errors fall from training with two to three to four |
  // |---|---|---|---|
  // | 1 | 3.9 | 1.9 | 2 of 4 sizes of the swarm |
  // | 1.15 | 3.3 | 1.5 | 3 of 4 |
  // | 1.85 | 2.2 | 1.3 | 2 of 4 |
  // | 8 | 1.6 | 0.99 | 3 of 4 |
  // | paper | 3.3 | 0.71 | 4 of 4 |
  //
  // A network trained with two vehicles harms four only if additional wakes have little effect, because the network
  // adds them up. The baseline's growth with the number of vehicles requires that they do have an effect. No
  // composition of this family gives both, so the two rows of the paper's table do not follow from pairwise wakes and
  // the stated training alone. Thrust saturates during 3 to 6 % of the time with a battery at 3.1 V, and never at 4.1 V.
  //
  // On the published flights (`reproduce real-flights --recorded DIR --full`), eight networks compete on the
  // selecting flights. The chosen one leaves 1.829 gf in the mean over scenarios; the published networks
  // leave 1.859 gf on flights that they were trained on. Its worst scenario, a swap of two small vehicles and
  // a large one, has 1.12 times their error. The proved joint Lipschitz bounds are 373.0 for the large pair
  // (published networks: 417.6) and 360.1 for the small one (373.7). Seeds matter: with `--seed 11` the mean
  // is 1.869 gf and the worst ratio 1.20.
  //
  // Physics without a network explains most of it. `compare TEST --budget DEVELOPMENT --network network.toml`
  // prints how the vertical residual falls on flights that the fit has not seen (RMS in gf); the published
  // networks have seen them:
  //
  // | neighbours and vehicle | nominal | + lag | + offset | + ground | + downwash | + all other effects | published networks |
  // |---|---|---|---|---|---|---|---|
  // | small alone, over the ground | 1.31 | 1.30 | 1.03 | 0.64 | 0.64 | 0.61 | 0.76 |
  // | large alone | 3.00 | 3.04 | 2.58 | 1.45 | 1.45 | 1.34 | 1.49 |
  // | small and small | 2.34 | 1.99 | 1.93 | 1.93 | 0.97 | 0.95 | 1.09 |
  // | large and large | 6.04 | 5.21 | 5.33 | 5.38 | 2.92 | 2.75 | 2.81 |
  //
  // The wake's torque at each rotor (effect `downwash_torque`), learned from ten simulated walks of two
  // vehicles, falls on test flights from 0.316 to 0.070 mN m. Feeding it forward reduces sideways errors by
  // 24 to 38 %.

  // %%
}
