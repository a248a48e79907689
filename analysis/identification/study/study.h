/// @file The whole question in one call: where a model fails, what it is missing, and how far adding it lowers the
/// error.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "analysis/identification/diagnose.h"
#include "analysis/identification/ladder.h"
#include "analysis/identification/study/picture_data.h"
#include "analysis/identification/study/replay_data.h"
#include "analysis/residuals/comparison.h"

namespace swarmcert::identification {

/// Errors of one model on all flights, and on those that nothing was fitted to.
struct StudyErrors {
  residuals::Comparison all, test;
};

struct Study {
  Diagnosis diagnosis;  ///< of the given model, on the flights that are not for the test
  Ladder ladder;        ///< effects added one by one; ladder.model is the fitted model
  StudyErrors before, after;
  PictureData pictures;
  std::vector<ReplayFlight> replay;  ///< flights with the worst moments under the given model first
};

/// Shows progress: steps done of all, and what is being done.
using StudyProgress = std::function<void(int done, int total, const std::string& what)>;

/// Studies inputs' only model. The test flights are scored, and decide nothing.
/// @param split which flights are for what; split_flights() if not given.
/// @throws std::invalid_argument unless `inputs` has exactly one model.
Study study(const residuals::Inputs& inputs, const std::optional<Split>& split, int jobs,
            const StudyProgress& progress);

}  // namespace swarmcert::identification
