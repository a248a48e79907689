/// @file A complete study: where a model fails, what it is missing, and by how much adding it reduces the error.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "analysis/identification/diagnose.h"
#include "analysis/identification/ladder.h"
#include "analysis/identification/study/picture_data.h"
#include "analysis/residuals/comparison.h"
#include "analysis/residuals/prediction.h"

namespace swarmcert::identification {

/// Errors of a model on all flights, and on those not used for any fit; `test` is empty if nothing is held out.
struct StudyErrors {
  residuals::Comparison all, test;
  std::vector<residuals::FlightPrediction>
      predictions;  ///< over kHorizon_s, on `test`, or else on all flights
};

inline constexpr double kHorizon_s = 0.5;

struct Study {
  Diagnosis diagnosis;  ///< of the given model, on all flights except the test flights
  Ladder ladder;        ///< effects added one by one; ladder.model is the fitted model
  StudyErrors before, after;
  PictureData pictures;
};

/// Reports progress: number of steps done, out of all steps, and the current activity.
using StudyProgress = std::function<void(int done, int total, const std::string& what)>;

/// Studies the only model of `inputs`. The test flights are scored and decide nothing.
/// @param split use of each flight; split_flights() if not given
/// @throws std::invalid_argument unless `inputs` has exactly one model.
Study study(const residuals::Inputs& inputs, const std::optional<Split>& split, int jobs,
            const StudyProgress& progress);

}  // namespace swarmcert::identification
