/// @file One training run as the experiments need it: taken up again where it stopped, or read back if it is done.
#pragma once

#include <string>
#include <vector>

#include "analysis/learning/output_scale.h"
#include "analysis/learning/training_run.h"
#include "analysis/reproduction/setting.h"
#include "nn/weights/network.h"

namespace swarmcert::reproduction {

struct LearnOptions {
  learning::NetworkSizes sizes;
  files::GammaStatement gamma;
  training::Layers layers = training::Layers::kFree;
  double max_lipschitz = 0;   ///< see learning::RunOptions
  bool begins_within = true;  ///< likewise
  bool turns = false;         ///< see training::TrainerOptions
  double rate = 3e-3;
  int batch = 256;
  int steps = 0;   ///< of the optimiser: as many whole epochs as come nearest, at least one
  int epochs = 0;  ///< where steps is 0
  std::uint64_t seed = 1;
  int patience = 0;  ///< epochs without improvement; 0: all are run
  int teachers = 0;  ///< see learning::run_with_teachers()
  int folds = 0;     ///< see learning::cross_fit(); what it has not seen scales and silences the outputs
  bool tight_bounds = false;  ///< LipSDP at the small size as well, not only products of norms
};

/// A trained network and what was measured of it. Read back from its folder where that was made by the same call.
struct Learned {
  files::Network network;
  std::string folder;
  std::vector<std::pair<std::string, double>> set_bounds;  ///< proved, gf per unit of input
  double bound = 0;                                        ///< the largest of them
  bool keeps_gamma = false;                                ///< proved
  double test_gf = 0, nothing_gf = 0;  ///< RMSE on the test flights, with and without the network
  int samples = 0, epochs = 0, best_epoch = 0;
  /// Seed and error on the selecting flights, gf, of every network that was trained: teachers, and the taught one last;
  /// or those of the folds.
  std::vector<std::pair<std::uint64_t, double>> scores;
  std::uint64_t kept_seed = 0;      ///< of the one that stands here
  learning::OutputSupport support;  ///< with folds, in gf
};

/// Trains on what `load` returns, which is called only where there is something to do, and writes network, certificate
/// and numbers into `folder`.
/// @param key text that changes with everything that the result depends on; a folder with another key is begun anew.
Learned learn(const Setting& setting, const LearnOptions& options, const std::string& folder,
              const std::string& key, const std::function<learning::LearningData()>& load);

}  // namespace swarmcert::reproduction
