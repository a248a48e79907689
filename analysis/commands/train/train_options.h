/// @file Options of `train`.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "analysis/commands/shared/flight_options.h"
#include "analysis/learning/dataset.h"
#include "analysis/learning/training_run.h"

namespace swarmcert::analysis {

struct TrainOptions {
  FlightOptions flights;
  std::vector<std::string> select, test;
  std::string output, report, quantity = "force_z", split = "auto";
  learning::NetworkSizes sizes;
  learning::RunOptions run;
  std::string gamma_scope = "layer", gamma_mode = "clip", layers = "free";
  std::string weights = "errors", symmetry = "vertical";
  bool no_ground = false, allow_worse = false;
  int teachers = 0, folds = 0;
};

/// Declares the options of `train`, with their defaults.
void declare_train_options(CLI::App& app, TrainOptions& options);

}  // namespace swarmcert::analysis
