/// @file The result of `diagnose`, described, and the parts of it that `study` shares.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "analysis/commands/shared/ranking.h"
#include "analysis/identification/balance/accelerometer_balance.h"
#include "analysis/identification/balance/torque_balance.h"
#include "analysis/identification/diagnose.h"
#include "analysis/identification/fleet/difference.h"
#include "analysis/identification/fleet/each.h"
#include "analysis/identification/rotors/rotor_balance.h"
#include "analysis/residuals/failing_place.h"

namespace swarmcert::analysis {

/// Returns the verdict on `diagnoses` and what they name.
Judgement judgement_of(const std::vector<identification::Diagnosis>& diagnoses);

/// What is missing and what is left, for all kinds of vehicles.
struct Diagnosed {
  Judgement judgement;
  std::vector<identification::Diagnosis> diagnoses;  ///< one per kind; with --against one per vehicle
  std::vector<std::string> problems;
};
Diagnosed diagnosed(std::vector<identification::Diagnosis> diagnoses);
void describe(files::Record& record, const Diagnosed& found);

/// What the ranking is the difference from.
struct Against {
  std::vector<std::string> flights;
  std::vector<identification::Difference> differences;  ///< one per vehicle
};
void describe(files::Record& record, const Against& against);

struct DiagnoseResult {
  std::optional<residuals::FailingPlace> fails;  ///< the given model; absent with --against
  Diagnosed found;
  std::optional<Against> against;
  std::optional<std::vector<identification::RotorBalance>> rotors;
  std::optional<std::vector<identification::TorqueBalance>> torques;
  std::optional<std::vector<identification::AccelerometerBalance>> sensors;
  std::optional<std::vector<identification::Each>> each;
  std::optional<std::vector<std::string>> next;
};
void describe(files::Record& record, const DiagnoseResult& result);

}  // namespace swarmcert::analysis
