/// @file The curriculum of section III-C as files: flights and networks of each stage, made on demand.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "analysis/reproduction/flying.h"
#include "analysis/reproduction/learn.h"

namespace swarmcert::reproduction {

/// Stage 0: two vehicles without a network. 1: two with the network of stage 0. 2: three with the network of stage 1.
/// 3: four with the network of stage 2. Every stage flies one random walk and repeated swaps. Its network learns from
/// these flights and from those of all earlier stages: the paper calls its curriculum cumulative. Flights with fewer
/// vehicles ensure that swarms with fewer neighbours are not forgotten.
///
/// A network allows closer flight (section III-C), so the random walks of every stage with a network are contracted.
/// Otherwise the task's repulsion would keep more vehicles as far apart as fewer ones. The factor is our choice.
struct Stage {
  int vehicles = 0;
  double drawn_in = 1;          ///< contraction of the setpoints of the random walks, see Plan
  const char* flown_with = "";  ///< as text
};
inline constexpr Stage kStages[] = {{2, 1.0, "no network"},
                                    {2, 0.95, "network of 2, uncompensated"},
                                    {3, 0.9, "network of 2"},
                                    {4, 0.7, "network of 3"}};
inline constexpr int kNumStages = 4;
/// Returns the stage whose network is "trained with" this many vehicles, 2 to 4.
inline int stage_of(int trained_with) { return trained_with - 1; }

/// Statistics of the flights of a stage.
struct StageFlights {
  std::string folder;           ///< with fit/, select/ and test/
  double least_distance_m = 0;  ///< between any two vehicles in a random walk; mean over several walks
  double percentile_distance_m =
      0;  ///< first percentile of the distances to the nearest other vehicle; mean over several walks
};

/// The stages of one truth and one training seed. Existing folders of the same origin are read instead of made again.
class Stages {
 public:
  /// @param training_seed 0, 1, ...: each has its own networks and flights.
  Stages(const Setting& setting, const Truth& truth, int training_seed);

  StageFlights flights(int stage);
  Learned learned(int stage);
  /// Returns the network used in flight by stage `stage`; nothing for stage 0.
  std::optional<files::Network> flown_network(int stage);
  /// Returns the data from which the network of a stage learns, selects and tests; it is tested on the flights of its
  /// stage.
  learning::LearningData data(int stage, const learning::NetworkSizes& sizes);
  /// Returns text that changes with everything on which data() depends.
  std::string data_key(int stage);
  /// Returns the flights of a stage with the nominal model.
  /// @param use "fit", "select" or "test".
  residuals::Inputs inputs(const std::vector<int>& stages, const std::string& use);
  /// Returns text that changes with everything on which the flights of `stage` depend.
  std::string key(int stage);

  const Truth& truth() const { return truth_; }
  std::uint64_t seed(const std::string& use, std::uint64_t number = 0) const;
  LearnOptions learn_options() const;

 private:
  /// Flies a stage into `folder` and returns the statistics of its flights.
  files::Json fly_stage(int stage, const std::string& folder);

  const Setting& setting_;
  Truth truth_;
  std::string folder_;
  int training_seed_;
};

/// Flies `plan` and writes its logs into `folder`.
Flown fly_logged(const Setting& setting, const Truth& truth, const Plan& plan, const files::Network* network,
                 const std::string& folder);

/// Returns the flights in `folders` with the nominal model of `truth`, which is written next to the first folder.
residuals::Inputs read_simulated(const Truth& truth, const std::vector<std::string>& folders);

}  // namespace swarmcert::reproduction
