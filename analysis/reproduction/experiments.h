/// @file The experiments behind the paper's table and figures, and further experiments.
#pragma once

#include <functional>
#include <utility>

#include "analysis/reproduction/finding.h"
#include "analysis/reproduction/setting.h"

namespace swarmcert::reproduction {

struct Experiment {
  std::string name, summary;
  Finding (*run)(const Setting& setting) = nullptr;
  /// Describes the fields of its result, from default values.
  std::function<void(files::Record&)> describe_result;
};

/// Returns an experiment whose result is a described struct.
template <class Result>
Experiment experiment(std::string name, std::string summary, Finding (*run)(const Setting&)) {
  return {std::move(name), std::move(summary), run,
          [](files::Record& record) { describe(record, Result{}); }};
}

/// Section III-C: flights of two vehicles without a network, then with it, then of more vehicles; the distances that
/// they reach, and whether the labels depend on the compensation.
Experiment curriculum();
/// Section V-B: error on unseen flights over minutes of training flight.
Experiment minutes_of_data();
/// tab:nnperf, with the errors along x and y added.
Experiment performance();
/// Three results of section V-C that tab:nnperf alone does not contain: a network trained with two vehicles harms
/// four; thrust saturates in swaps of three and more; errors decrease with the number of vehicles in training. They
/// are tested for combinations of wakes, batteries and heights that the paper leaves open, to find which combinations
/// show which result.
Experiment claims();
Experiment figure_intro();
Experiment figure_swaps();
Experiment figure_heatmap();
Experiment figure_validation();
/// f(a, b) - f(a) - f(b) for the truth, for a network, and for recorded flights of three vehicles.
Experiment superposition();
/// Test error and the tracking error predicted from it over the certified Lipschitz bound, as gamma varies.
Experiment lipschitz_tradeoff();
/// Test errors of networks with samples rotated about the vertical and with samples as recorded, from all
/// flights and from half of them; test error over the proved joint bound, with a limit on the norms of the layers or
/// on the bound itself.
Experiment symmetry();
/// Test error at equal proved joint bounds: spectral normalisation as in the paper, projection onto the bound, and
/// layers that keep it by construction (nn/training/bounded_layers.h). Uses simulated flights, or recorded flights of
/// small vehicles.
Experiment bounded_layers();
/// Networks trained on the published flights compared with the published networks; then physics first.
Experiment real_flights();
/// Bounds on the peak tracking errors of gains used in flight, computed from the gains with a stated coverage:
/// calibrated on the flights of one folder, reported on those of another. Its run throws files::InputError if a folder
/// is missing or has too few flights for the coverage.
Experiment gains_in_flight();

/// Returns all experiments in the order of --help.
const std::vector<Experiment>& experiments();

}  // namespace swarmcert::reproduction
