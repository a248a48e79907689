/// @file The result of `study`, described.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "analysis/commands/add/causes.h"
#include "analysis/commands/diagnose/diagnose_result.h"
#include "analysis/commands/shared/prediction_output.h"
#include "analysis/identification/study/study.h"
#include "analysis/residuals/failing_place.h"

namespace swarmcert::analysis {

/// Differences from the flights of --against.
struct Changes {
  Against against;
  Judgement judgement;
  std::vector<identification::RotorBalance> rotors;
};

struct StudyResult {
  identification::Study study;
  Diagnosed found;
  residuals::FailingPlace fails, left;  ///< where the given model fails, and the fitted one, on all flights
  /// Over half a second, by the given and by the fitted model, where nothing was fitted; absent without rates.
  std::optional<Prediction> predicted_before, predicted_after;
  std::vector<Cause> causes;
  std::vector<std::string> next;
  std::string next_command;
  std::optional<Changes> changes;
};
void describe(files::Record& record, const StudyResult& result);

/// @param next_command what to type next
StudyResult study_result(const identification::Study& study, const residuals::ForceUnit& unit,
                         const std::string& next_command);

}  // namespace swarmcert::analysis
