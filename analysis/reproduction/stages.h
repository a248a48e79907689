/// @file The curriculum of section III-C as files: flights and networks of each stage, made when they are asked for.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "analysis/reproduction/flying.h"
#include "analysis/reproduction/learn.h"

namespace swarmcert::reproduction {

/// Stage 0: two vehicles without a network. 1: two with the network of stage 0. 2: three with that of stage 1. 3: four
/// with that of stage 2. Every stage flies one random walk and repeated swaps. Its network learns from these flights
/// and from those of all stages before it: the paper calls its curriculum cumulative. What was flown with fewer
/// vehicles keeps swarms with fewer neighbours from being forgotten.
///
/// A network allows closer flight (section III-C): the random walks of every stage that has one are drawn in further.
/// Left as it is, the task's repulsion keeps more vehicles as far apart as fewer. How far is our choice.
struct Stage {
  int vehicles;
  double drawn_in;         ///< of the random walks' set points, see Plan
  const char* flown_with;  ///< in words
};
inline constexpr Stage kStages[] = {{2, 1.0, "no network"},
                                    {2, 0.95, "network of 2, uncompensated"},
                                    {3, 0.9, "network of 2"},
                                    {4, 0.7, "network of 3"}};
inline constexpr int kNumStages = 4;
/// The stage whose network is "trained with" so many vehicles, 2 to 4.
inline int stage_of(int trained_with) { return trained_with - 1; }

/// What was seen of a stage's flights.
struct StageFlights {
  std::string folder;           ///< with fit/, select/ and test/
  double least_distance_m = 0;  ///< between any two vehicles in a random walk; mean of several walks
  double percentile_distance_m =
      0;  ///< 1 % of the distances to the nearest other vehicle are below; likewise
};

/// One truth and one training seed. Nothing is made twice: folders that are there and of the same origin are read.
class Stages {
 public:
  /// @param training_seed 0, 1, ...: networks and flights of their own.
  Stages(const Setting& setting, const Truth& truth, int training_seed);

  StageFlights flights(int stage);
  Learned learned(int stage);
  /// The network that flies stage `stage`; nothing for stage 0.
  std::optional<files::Network> flown_network(int stage);
  /// What the network of a stage learns from, selects and tests by: it is tested on the stage's own flights.
  learning::LearningData data(int stage, const learning::NetworkSizes& sizes);
  /// Text that changes with everything data() depends on.
  std::string data_key(int stage);
  /// Flights of a stage with the nominal model. @param use "fit", "select" or "test".
  residuals::Inputs inputs(const std::vector<int>& stages, const std::string& use);
  /// Text that changes with everything the flights of `stage` depend on.
  std::string key(int stage);

  const Truth& truth() const { return truth_; }
  std::uint64_t seed(const std::string& use, std::uint64_t number = 0) const;
  LearnOptions learn_options() const;

 private:
  /// Flies a stage into `folder`; what was seen of its flights.
  files::Json fly_stage(int stage, const std::string& folder);

  const Setting& setting_;
  Truth truth_;
  std::string folder_;
  int training_seed_;
};

/// Flies `plan` and writes its logs into `folder`.
Flown fly_logged(const Setting& setting, const Truth& truth, const Plan& plan, const files::Network* network,
                 const std::string& folder);

/// Flights in `folders` with the nominal model of `truth`, which is written beside the first of them.
residuals::Inputs read_simulated(const Truth& truth, const std::vector<std::string>& folders);

}  // namespace swarmcert::reproduction
