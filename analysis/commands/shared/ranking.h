/// @file What a model or a log lacks, as diagnose and study report it: the entries of `ranking`, and the verdict.
#pragma once

#include <cstddef>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "analysis/commands/shared/effect_output.h"
#include "analysis/identification/selected.h"
#include "analysis/identification/verdict.h"
#include "nn/base/record.h"

namespace swarmcert::analysis {

inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// A coefficient by least squares and by instrumental variables, as results show it.
struct InstrumentResult {
  identification::InstrumentedValue value;
};
void describe(files::Record& record, const InstrumentResult& result);

/// What could stand in the place of an entry.
struct Alternative {
  std::vector<std::string> names;  ///< what cannot be told apart from each other in any flight
  double odds = kUnknown;          ///< relative to the entry
  std::string fly;                 ///< flights that would decide
};

/// One entry of `ranking`. Numbers that do not apply to a cause are NaN, and null in JSON.
struct Ranked {
  std::string effect, kind;
  std::optional<std::string> vehicle, against, statement;
  std::optional<int> rotor;
  double rmse_before_N = kUnknown, rmse_after_N = kUnknown, drop = kUnknown;
  Interval drop_interval = {kUnknown, kUnknown};
  FittedValues parameters;
  bool per_vehicle = true;
  std::map<std::string, Interval> model_form;
  std::map<std::string, InstrumentResult> instrument;
  std::string equivalence_class;              ///< as shown: everything that these flights cannot tell apart
  std::vector<std::string> never_told_apart;  ///< what no flight can tell apart; empty if nothing
  std::vector<Alternative> rivals;            ///< on these flights, one name each
  std::string separated_by;
  double paired_z = kUnknown, wald_z = kUnknown, evidence_bits = kUnknown;
  std::size_t records = 0, blocks = 0, flights = 0;
  bool is_sensor = false;
};
void describe(files::Record& record, const Ranked& entry);

/// What is missing, and the verdict on it.
struct Judgement {
  identification::Verdict verdict = identification::Verdict::kInconclusive;
  std::string reason;  ///< why the verdict is inconclusive
  std::vector<Ranked> ranking;

  /// Adds causes beside those of the force. Any makes the verdict missing_effect, unless there is no answer.
  void append(std::vector<Ranked> causes);
};
/// Describes `verdict` and `ranking`.
void describe(files::Record& record, const Judgement& judgement);

}  // namespace swarmcert::analysis
