/// @file One training run for an experiment: resumed where it stopped, or read back if it is complete.
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
  int steps = 0;   ///< optimiser steps: rounded to the nearest number of whole epochs, at least one
  int epochs = 0;  ///< used if steps is 0
  std::uint64_t seed = 1;
  int patience = 0;           ///< epochs without improvement; 0: runs all epochs
  int teachers = 0;           ///< see learning::run_with_teachers()
  int folds = 0;              ///< see learning::cross_fit(); unseen flights scale and silence the outputs
  bool tight_bounds = false;  ///< uses LipSDP also at the small size instead of products of norms
};

/// A trained network and its measured errors. Read back from its folder if the same call made it.
struct Learned {
  files::Network network;
  std::string folder;
  std::vector<std::pair<std::string, double>> set_bounds;  ///< proved, gf per unit of input
  double bound = 0;                                        ///< the largest set bound
  bool keeps_gamma = false;                                ///< proved
  double test_gf = 0, nothing_gf = 0;  ///< RMSE on the test flights, with and without the network
  int samples = 0, epochs = 0, best_epoch = 0;
  /// Seed and error on the selecting flights, gf, of every trained network: the teachers and then the taught network,
  /// or the networks of the folds.
  std::vector<std::pair<std::uint64_t, double>> scores;
  std::uint64_t kept_seed = 0;      ///< seed of the network in this struct
  learning::OutputSupport support;  ///< with folds, in gf
};

/// Trains on the data returned by `load`, which is called only if there is something to do, and writes network,
/// certificate and numbers into `folder`.
/// @param key text that changes with everything on which the result depends; a folder with another key is started anew.
Learned learn(const Setting& setting, const LearnOptions& options, const std::string& folder,
              const std::string& key, const std::function<learning::LearningData()>& load);

}  // namespace swarmcert::reproduction
