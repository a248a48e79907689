/// @file An error ladder as result and as text.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "analysis/identification/clocks/clock_offset.h"
#include "analysis/identification/labels/mislabelled.h"
#include "analysis/identification/ladder.h"
#include "analysis/report/table.h"
#include "analysis/residuals/force_unit.h"
#include "nn/base/record.h"

namespace swarmcert::analysis {

/// Describes the rows of a ladder.
void describe_ladder_row(files::Record& record, const stability::LadderRow& row);
/// Describes `earlier`, `test_looks` and `split`.
void describe_climb(files::Record& record, const identification::Ladder& ladder);

/// A ladder with the fitted values, and where it comes from.
struct LadderOfModel {
  std::string title;
  std::vector<stability::LadderRow> rows;
  std::vector<stability::EffectSpec> effects;
};

/// What `add EFFECT` did.
struct Climbed {
  identification::Ladder ladder;
  std::vector<identification::ClockOffset> clocks;
  std::vector<identification::Mislabelled> labels;
};

/// Of add EFFECT and add undo, `own` and, of the former, `climbed`; of add show, `shown`, titled by files.
struct AddResult {
  std::optional<LadderOfModel> own;
  std::optional<Climbed> climbed;
  std::optional<std::vector<LadderOfModel>> shown;
};
void describe(files::Record& record, const AddResult& result);

/// Returns a row per step: its errors, "-" where nothing was held out, and why it was refused, or what decided instead.
Table ladder_table(const std::vector<stability::LadderRow>& rows, const residuals::ForceUnit& unit);
/// Says which quantity the errors of the rows measure: the force residual, or the balance of the rotors where that
/// was fitted.
std::string what_rows_measure(const std::vector<stability::LadderRow>& rows);
void print_ladder(const identification::Ladder& ladder, const residuals::ForceUnit& unit);

}  // namespace swarmcert::analysis
