/// @file The published flights as used by the experiments: which flights are fitted, and how networks learn from them.
#pragma once

#include <string>

#include "analysis/learning/trained_network.h"
#include "analysis/reproduction/finding.h"
#include "analysis/reproduction/learn.h"
#include "analysis/reproduction/residual_blocks.h"

namespace swarmcert::reproduction {

/// The published flights by use. No fit uses a flight of `test`.
struct Recorded {
  residuals::Inputs fit, select, test;
  learning::LearningFlights flights() const { return {&fit, &select, &test}; }
};

/// @param published_signals labels as computed by the authors of the networks, see residuals::CutRules.
Recorded recorded_flights(const Setting& setting, bool published_signals);

/// Selects the flights in which every vehicle is small.
Recorded of_small_vehicles(const Recorded& recorded);

/// Adds the recorded files to the inputs of the finding.
void add_inputs(const Recorded& recorded, Finding& finding);

/// Returns `inputs` with the deep set added to all models as an effect.
residuals::Inputs with_network(residuals::Inputs inputs, const std::string& network);

/// Writes network.toml for the published weights, which stay where they are, into the work folder. Returns its path.
std::string published_network(const Setting& setting);
/// Returns the Lipschitz bounds of the published network.
learning::Certified certified_published(const Setting& setting);

/// Sizes, limits and steps of the networks trained on recorded flights; chosen on the selecting flights.
LearnOptions recorded_options(const Setting& setting);
/// Options of the networks that follow fitted physics, each of which leaves out one fold of the development flights;
/// chosen by cross-validation over these flights.
LearnOptions folds_options(const Setting& setting);

learning::LearningData load_recorded(const Setting& setting, const Recorded& recorded,
                                     const LearnOptions& options);
/// Trains into the folder `name`; `what` distinguishes networks from the same flights.
Learned train_recorded(const Setting& setting, const Recorded& recorded, const LearnOptions& options,
                       const std::string& name, const std::string& what);

/// Returns text that changes with every flight.
std::string recorded_key(const Setting& setting, const Recorded& recorded);

/// Physics first: fits lag, offsets, ground, jet and the other effects to all development flights; the networks of
/// the folds learn the remainder, where that helps. Adds a table with the contribution of each step, and a table that
/// compares it with the published networks on the test flights, which are named.
void physics_first(const Setting& setting, Finding& finding);

std::string gf(double value);
std::string gf(const Interval& interval);

}  // namespace swarmcert::reproduction
