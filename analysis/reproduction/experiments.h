/// @file The experiments behind the paper's table and figures, and further experiments.
#pragma once

#include "analysis/reproduction/finding.h"
#include "analysis/reproduction/setting.h"

namespace swarmcert::reproduction {

/// Section III-C: flights of two vehicles without a network, then with it, then of more vehicles; the distances that
/// they reach, and whether the labels depend on the compensation.
Finding curriculum(const Setting& setting);
/// Section V-B: error on unseen flights over minutes of training flight.
Finding minutes_of_data(const Setting& setting);
/// tab:nnperf, with the errors along x and y added.
Finding performance(const Setting& setting);
/// Three results of section V-C that tab:nnperf alone does not contain: a network trained with two vehicles harms
/// four; thrust saturates in swaps of three and more; errors decrease with the number of vehicles in training. They
/// are tested for combinations of wakes, batteries and heights that the paper leaves open, to find which combinations
/// show which result.
Finding claims(const Setting& setting);
Finding figure_intro(const Setting& setting);
Finding figure_swaps(const Setting& setting);
Finding figure_heatmap(const Setting& setting);
Finding figure_validation(const Setting& setting);
/// f(a, b) - f(a) - f(b) for the truth, for a network, and for recorded flights of three vehicles.
Finding superposition(const Setting& setting);
/// Test error and the tracking error predicted from it over the certified Lipschitz bound, as gamma varies.
Finding lipschitz_tradeoff(const Setting& setting);
/// Test errors of networks with samples rotated about the vertical and with samples as recorded, from all
/// flights and from half of them; test error over the proved joint bound, with a limit on the norms of the layers or
/// on the bound itself.
Finding symmetry(const Setting& setting);
/// Test error at equal proved joint bounds: spectral normalisation as in the paper, projection onto the bound, and
/// layers that keep it by construction (nn/training/bounded_layers.h). Uses simulated flights, or recorded flights of
/// small vehicles.
Finding bounded_layers(const Setting& setting);
/// Networks trained on the published flights compared with the published networks; then physics first.
Finding real_flights(const Setting& setting);
/// Bounds on the peak tracking errors of gains used in flight, computed from the gains with a stated coverage:
/// calibrated on the flights of one folder, reported on those of another.
/// @throws files::InputError if a folder is missing or has too few flights for the coverage.
Finding gains_in_flight(const Setting& setting);

struct Experiment {
  std::string name, summary;
  Finding (*run)(const Setting& setting);
};

/// Returns all experiments in the order of --help.
const std::vector<Experiment>& experiments();

}  // namespace swarmcert::reproduction
