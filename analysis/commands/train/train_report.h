/// @file Report of a training run: learning curve, residuals before and after, map of the learned force.
#pragma once

#include <string>

#include "analysis/learning/output_scale.h"
#include "analysis/learning/training_run.h"
#include "nn/base/record.h"

namespace swarmcert::analysis {

/// Writes the report, including the result of the command, into `folder`. Returns the path of the HTML file.
std::string write_train_report(const learning::LearningData& data, const learning::Run& run,
                               const learning::OutputSupport& support, const files::Node& result,
                               const std::string& folder, bool overwrite);

}  // namespace swarmcert::analysis
