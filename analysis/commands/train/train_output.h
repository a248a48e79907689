/// @file Results of `train`, described and as text.
#pragma once

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "analysis/commands/train/train_options.h"
#include "analysis/learning/cross_fit.h"
#include "analysis/learning/dataset.h"
#include "analysis/learning/output_scale.h"
#include "analysis/learning/trained_network.h"
#include "analysis/learning/training_run.h"
#include "nn/base/record.h"

namespace swarmcert::analysis {

/// Root mean square errors in the unit of the targets.
struct Scores {
  double nothing = 0, network = 0;
};

struct Outcome {
  learning::TaughtRun trained;
  std::vector<learning::Score>
      members;  ///< networks of --folds, each scored on the fold left out of its fit; `trained` is their mean
  Scores all;
  std::vector<Scores> components;  ///< x, y, z; empty if the target has one component
  std::map<std::string, Scores> compositions;
  learning::OutputSupport support;  ///< from the selecting flights; with folds, from all flights
  learning::Certified certified;

  /// A network that is worse than no network on the selecting flights is not kept.
  bool kept() const {
    const auto& scales = support.scales;
    const bool silent = !scales.empty() && std::all_of(scales.begin(), scales.end(),
                                                       [](const auto& scale) { return scale.second == 0; });
    const learning::SupportedErrors selecting = support.all();
    return !silent && !(selecting.network >= selecting.nothing);
  }
};

/// Describes the result.
void describe_training(files::Record& record, const TrainOptions& options, const learning::LearningData& data,
                       const Outcome& outcome);

void print_training(const TrainOptions& options, const learning::LearningData& data, const Outcome& outcome);

}  // namespace swarmcert::analysis
