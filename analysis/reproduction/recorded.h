/// @file The published flights as used by the experiments: which flights are fitted, and how networks learn from them.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

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

/// One row of the ladder of physics, and how much its error falls from the row before.
struct PhysicsRow {
  std::string model;
  double rms_gf = 0;
  Interval interval_gf;
  std::optional<Estimate> fall;
  std::map<std::string, double> compositions;
};

/// Errors on the test flights, by kinds of neighbours and vehicle.
struct PhysicsComposition {
  std::string name;
  double physics_gf = 0, with_network_gf = 0, published_gf = 0;
};

/// Fits lag, offsets, ground, jet and the other effects to all development flights; the networks of the folds learn
/// the remainder, where that helps. Compared with the published networks on the test flights.
struct PhysicsFirst {
  std::vector<PhysicsRow> ladder;
  std::vector<PhysicsComposition> compositions;
  learning::OutputSupport support;    ///< decided on flights that no network of the folds has seen
  std::vector<std::string> left_out;  ///< flights that neither fit nor decide anything
  double bound = 0, published_bound = 0;
};

PhysicsFirst physics_first(const Setting& setting);
void describe(files::Record& record, const PhysicsFirst& physics);
/// Adds tables and notes; `finding` has the fields.
void show_physics(const PhysicsFirst& physics, Finding& finding);

}  // namespace swarmcert::reproduction
