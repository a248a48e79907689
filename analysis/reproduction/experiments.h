/// @file The experiments behind the paper's table and figures, and those beyond it.
#pragma once

#include "analysis/reproduction/finding.h"
#include "analysis/reproduction/setting.h"

namespace swarmcert::reproduction {

/// Section III-C: flights of two vehicles without a network, with it, then of more; how near they come, and whether
/// labels depend on the compensation.
Finding curriculum(const Setting& setting);
/// Section V-B: error on flights not seen, over minutes of flight learned from.
Finding minutes_of_data(const Setting& setting);
/// tab:nnperf, with the errors along x and y.
Finding performance(const Setting& setting);
/// Three results of section V-C that tab:nnperf alone does not give: that a network trained with two vehicles harms
/// four, that thrust saturates in swaps of three and more, and that errors fall with the vehicles in training. Flown
/// under compositions of wakes, batteries and heights that the paper leaves open: which of them show which result.
Finding claims(const Setting& setting);
Finding figure_intro(const Setting& setting);
Finding figure_swaps(const Setting& setting);
Finding figure_heatmap(const Setting& setting);
Finding figure_validation(const Setting& setting);
/// f(a, b) - f(a) - f(b) of the truth, of a network and of recorded flights of three vehicles.
Finding superposition(const Setting& setting);
/// Test error against certified Lipschitz bound over gamma, and the tracking error predicted from it.
Finding lipschitz_tradeoff(const Setting& setting);
/// Test errors of networks with exact symmetry about the vertical, with turned samples and with none, from all flights
/// and from half of them; test error over the proved joint bound, where the norms of layers are limited and where the
/// bound itself is.
Finding symmetry(const Setting& setting);
/// Test error at equal proved joint bounds: spectral normalisation as in the paper, projection onto the bound, and
/// layers that keep it by construction (nn/training/bounded_layers.h). Simulated flights, or those that were recorded
/// of small vehicles.
Finding bounded_layers(const Setting& setting);
/// Training on the published flights beside the published networks; then physics first.
Finding real_flights(const Setting& setting);
/// Peak tracking errors of gains that flew, bounded from the gains with a stated coverage: calibrated on the flights of
/// one folder, reported on those of another.
/// @throws files::InputError where a folder is missing or its flights are too few for the coverage.
Finding gains_in_flight(const Setting& setting);

struct Experiment {
  std::string name, summary;
  Finding (*run)(const Setting& setting);
};

/// All of them, in the order of --help.
const std::vector<Experiment>& experiments();

}  // namespace swarmcert::reproduction
