/// @file Flights as samples for training.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "analysis/residuals/inputs.h"
#include "nn/training/deep_set_loss.h"
#include "nn/weights/function_id.h"

namespace swarmcert::learning {

/// Permitted use of a sample.
enum class Use { kFit, kSelect, kTest };
const char* name(Use use);

/// The part of the wrench left by the vehicle's model that the networks learn.
enum class Target {
  kForceZ,  ///< the force along the world's z
  kForce,   ///< the force along the world's x, y, z
  kTorque,  ///< the torque about the world's x, y, z; needs logs of at least 400 Hz
};

/// How targets are stored and written.
struct TargetInfo {
  const char* quantity;  ///< as in network.toml
  const char* unit;      ///< as in network.toml
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
  bool ground = true;  ///< a phi for the vehicle's own height and velocity, always in the sum
};

/// Samples of one vehicle in one flight with a constant number of neighbours of each kind.
struct TrackSamples {
  std::string flight, scenario, vehicle;
  std::string composition;  ///< files::composition_name(): "small+small>small"
  Use use = Use::kFit;
  Eigen::Index begin = 0, end = 0;

  /// Group of the track, "21_swap_ss small>small". All groups have the same total weight.
  std::string group() const { return scenario + " " + composition; }
};

struct LearningData {
  Target target = Target::kForceZ;
  training::Layout layout;  ///< parts "phi:<kind>", with "phi:ground", and "rho:<kind>"
  training::Dataset samples;
  std::vector<TrackSamples> tracks;
  bool split_by_blocks = false;  ///< fitted flights also select and test by blocks: scores are optimistic
  std::vector<std::string> problems;

  std::vector<Eigen::Index> indices(Use use) const;
};

/// Sets the weights of the samples to fit: every group has the same total weight, and the weights sum to the number
/// of samples. Other samples keep their weights.
void balance(LearningData& data);

/// Progress callback: number of flights done, and total.
using Progress = std::function<void(int done, int total)>;

/// How samples are held back from the fit.
enum class SplitBy {
  kAuto,     ///< by flights; by blocks if there are fewer than three flights
  kFlights,  ///< whole flights, because neighbouring records of one flight are nearly equal
  kBlocks,   ///< blocks of 2 s of every flight, without 0.15 s at both ends
};

/// Flights by use. Only `fit` must not be null.
struct LearningFlights {
  const residuals::Inputs* fit;
  const residuals::Inputs* select = nullptr;  ///< determine when training ends
  const residuals::Inputs* test = nullptr;    ///< influence nothing
};

/// Loads flights as samples. The target of a sample is the force or torque that the vehicle's model leaves; inputs are
/// relative positions and velocities of the neighbours in the world frame (paper, section V-B), and the own (-z, -v)
/// for the ground.
/// Among the samples to fit, every group (a scenario and a composition of kinds) has the same total weight, because ten
/// flights of one task say no more about another task than one flight does. Other samples have weight 1.
///
/// If `select` or `test` is null, samples are held back from `fit`: of every five flights, in order of names and runs,
/// the third selects and the fifth tests; of three or four flights the last two do. With blocks, the same holds for
/// every five blocks of a flight. The set of networks and the fitted data do not depend on the test records.
/// @throws files::InputError if no record to fit of a vehicle with a model remains, or none has a neighbour.
LearningData load_learning_data(const LearningFlights& flights, const NetworkSizes& sizes, SplitBy split,
                                int jobs, const Progress& progress, Target target = Target::kForceZ);

}  // namespace swarmcert::learning
