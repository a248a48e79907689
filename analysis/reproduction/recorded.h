/// @file The published flights as the experiments use them: which are fitted, and how networks learn from them.
#pragma once

#include <string>

#include "analysis/learning/trained_network.h"
#include "analysis/reproduction/finding.h"
#include "analysis/reproduction/learn.h"
#include "analysis/reproduction/residual_blocks.h"

namespace swarmcert::reproduction {

/// The published flights by use. No fit sees a flight of `test`.
struct Recorded {
  residuals::Inputs fit, select, test;
  learning::LearningFlights flights() const { return {&fit, &select, &test}; }
};

/// @param published_signals labels as the networks' authors made them, see residuals::CutRules.
Recorded recorded_flights(const Setting& setting, bool published_signals);

/// The flights in which every vehicle is small.
Recorded of_small_vehicles(const Recorded& recorded);

/// Names the recorded files in the finding.
void add_inputs(const Recorded& recorded, Finding& finding);

/// `inputs` whose models all have the deep set as one more effect.
residuals::Inputs with_network(residuals::Inputs inputs, const std::string& network);

/// network.toml of the published weights, which stay where they are; written into the work folder.
std::string published_network(const Setting& setting);
/// Its Lipschitz bounds.
learning::Certified certified_published(const Setting& setting);

/// Sizes, limits and steps of the networks that learn from recorded flights; chosen on the flights that select.
LearnOptions recorded_options(const Setting& setting);
/// Those of the networks behind fitted physics, each of which leaves out a fold of the development flights; chosen by
/// cross-validation over these.
LearnOptions folds_options(const Setting& setting);

learning::LearningData load_recorded(const Setting& setting, const Recorded& recorded,
                                     const LearnOptions& options);
/// Into the folder `name`; `what` tells networks from the same flights apart.
Learned train_recorded(const Setting& setting, const Recorded& recorded, const LearnOptions& options,
                       const std::string& name, const std::string& what);

/// Text that changes with every flight.
std::string recorded_key(const Setting& setting, const Recorded& recorded);

/// Physics first: lag, offsets, ground, jet and the rest are fitted to all development flights, and networks of the
/// folds learn the remainder, where that helps. Adds a table with what each adds, and one beside the published networks
/// on the test flights, which are named.
void physics_first(const Setting& setting, Finding& finding);

std::string gf(double value);
std::string gf(const Interval& interval);

}  // namespace swarmcert::reproduction
