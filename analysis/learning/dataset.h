/// @file Flights as samples for training.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "analysis/residuals/inputs.h"
#include "nn/training/deep_set_loss.h"
#include "nn/weights/function_id.h"

namespace swarmcert::learning {

/// What a sample may be used for.
enum class Use { kFit, kSelect, kTest };
const char* name(Use use);

/// What the networks learn of the wrench that the vehicle's model leaves.
enum class Target {
  kForceZ,  ///< the force along the world's z
  kForce,   ///< the force along the world's x, y, z
  kTorque,  ///< the torque about the world's x, y, z; needs logs of at least 400 Hz
};

/// How targets are stored and written.
struct TargetInfo {
  const char* quantity;  ///< as in network.toml
  const char* unit;      ///< likewise
  const char* words;
  int components;
  double SI_per_unit;
};
const TargetInfo& info(Target target);

/// Hidden layers and the width H between phi and rho; the paper's are 25, 40, 40 and 40, 40, 40 with H = 40.
struct NetworkSizes {
  std::vector<int> phi = {25, 40, 40};
  std::vector<int> rho = {40, 40, 40};
  int features = 40;
  bool ground = true;       ///< a phi of the vehicle's own height and velocity, always in the sum
  bool invariants = false;  ///< every phi sees invariants under turns about the vertical (nn/invariants.h)
};

/// Samples of one vehicle in one flight, with as many neighbours of each kind throughout.
struct TrackSamples {
  std::string flight, scenario, vehicle;
  std::string composition;  ///< files::composition_name(): "small+small>small"
  Use use = Use::kFit;
  Eigen::Index begin = 0, end = 0;

  /// Tracks of one group count the same together as those of any other: "21_swap_ss small>small".
  std::string group() const { return scenario + " " + composition; }
};

struct LearningData {
  Target target = Target::kForceZ;
  bool invariants = false;  ///< inputs of the samples are invariants of the states
  training::Layout layout;  ///< parts "phi:<kind>", with "phi:ground", and "rho:<kind>"
  training::Dataset samples;
  std::vector<TrackSamples> tracks;
  bool split_by_blocks = false;  ///< blocks of flights that are fitted judge: scores are too good
  std::vector<std::string> problems;

  std::vector<Eigen::Index> indices(Use use) const;
};

/// What phi sees of a neighbour's relative state, and the ground's phi of the vehicle's own: the state, or its
/// invariants as nn/deep_set.h computes them.
/// @param state [nn::kRelativeState] and [nn::kOwnState].
std::vector<float> seen_of_neighbour(const std::vector<float>& state, bool invariants);
std::vector<float> seen_of_own(const std::vector<float>& state, bool invariants);

/// Sets the weights of the samples to fit: every group weighs the same in total, and all together as many as there are
/// samples. Others keep theirs.
void balance(LearningData& data);

/// Shows progress: flights done of all.
using Progress = std::function<void(int done, int total)>;

/// How samples are held back from the fit.
enum class SplitBy {
  kAuto,     ///< by flights; by blocks where there are fewer than three
  kFlights,  ///< as wholes: neighbouring records of one flight are nearly the same
  kBlocks,   ///< blocks of 2 s of every flight, without the 0.15 s at both ends
};

/// Flights by what they are for. Pointers may be null but for `fit`.
struct LearningFlights {
  const residuals::Inputs* fit;
  const residuals::Inputs* select = nullptr;  ///< decide when training ends
  const residuals::Inputs* test = nullptr;    ///< decide nothing
};

/// Loads flights. The target of a sample is what the vehicle's model leaves of the force or torque; inputs are relative
/// positions and velocities of the neighbours in the world frame (paper, section V-B), and own (-z, -v) for the ground;
/// or, as `sizes` says, invariants of them, as the evaluator computes them in float32.
/// Among the samples to fit, every group, which is a scenario and a composition of kinds, gets the same total weight:
/// ten flights of one task say no more of another than one does. The others have weight 1.
///
/// What `select` and `test` do not name is held back from `fit`: of every five flights, in order of names and runs, the
/// third selects and the fifth tests; of three or four flights the last two do. By blocks: of every five blocks of a
/// flight, likewise. Which networks there are, and what is fitted, does not depend on the records that test.
/// @throws files::InputError if no record to fit of a vehicle with a model is left, or none has a neighbour;
///   std::invalid_argument for invariants with another target than the vertical force.
LearningData load_learning_data(const LearningFlights& flights, const NetworkSizes& sizes, SplitBy split,
                                int jobs, const Progress& progress, Target target = Target::kForceZ);

}  // namespace swarmcert::learning
