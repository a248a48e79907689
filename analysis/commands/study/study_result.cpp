#include "analysis/commands/study/study_result.h"

#include "analysis/commands/add/add_output.h"
#include "analysis/commands/diagnose/diagnose_output.h"
#include "analysis/commands/diagnose/rotor_output.h"

namespace swarmcert::analysis {
namespace {

using files::Record;
using identification::Split;
using identification::StudyErrors;

void describe_group(Record& record, const residuals::GroupErrors& errors) {
  const residuals::ErrorStatistics& s = errors.statistics;
  const auto add = [&record](const char* name, const residuals::Axes& axes, const char* meaning) {
    record.field(name, files::AxesAndTotal{axes.x, axes.y, axes.z, axes.total}, meaning, "N", "estimate");
  };
  record.field("records", s.samples, "");
  add("rmse", s.rmse, "Root mean square of the residual; total: of the vector.");
  add("bias", s.bias, "Its mean; total: length of the mean vector.");
  add("p95", s.p95, "95 % quantile of its magnitude.");
  add("max", s.max, "Its largest magnitude.");
}

void describe_study_errors(Record& record, const StudyErrors& errors,
                           const std::optional<Prediction>& prediction) {
  record.object("all", "On all flights.", [&](Record& r) { describe_group(r, errors.all.overall); });
  record.object("test", "On what is held out.", [&](Record& r) { describe_group(r, errors.test.overall); });
  record.may("prediction", prediction, "Of half a second from each measured state of what is held out.");
}

const char* how_held_out(Split::By by) {
  static constexpr const char* kHow[] = {"flights", "parts of flights", "nothing"};
  return kHow[static_cast<std::size_t>(by)];
}

void describe_changes(Record& record, const Changes& changes) {
  record.field("against", changes.against, "With --against: what was held, vehicle by vehicle.");
  record.object(
      "changed", "With --against: what differs beyond the scatter of the other flights.", [&](Record& r) {
        describe(r, changes.judgement);
        r.list("rotors", changes.rotors, "Per vehicle, and per flight, what each rotor gives in slow flight.",
               describe_rotors);
      });
}

}  // namespace

void describe(Record& record, const StudyResult& result) {
  const identification::Study& study = result.study;
  record.object("before", "Errors of the given model.",
                [&](Record& r) { describe_study_errors(r, study.before, result.predicted_before); });
  record.object("after", "Errors of the fitted model.",
                [&](Record& r) { describe_study_errors(r, study.after, result.predicted_after); });
  record.field("fails", result.fails, "Where the given model fails.");
  record.field("left", result.left, "Where the fitted model fails.");
  record.field("causes", result.causes, "What was added, in order, and what each is worth.");
  record.object("held_out", "What no fit has seen; errors of causes are of these.", [&](Record& r) {
    r.field("how", how_held_out(study.ladder.split.by),
            "flights, parts of flights (too few flights; 2 s lie between parts) or nothing.");
    r.field("records", study.after.test.overall.statistics.samples, "");
  });
  record.field("next_command", result.next_command, "What to type next.");
  record.list("ladder", study.ladder.rows, "One row per step.", describe_ladder_row);
  describe_climb(record, study.ladder);
  record.list("effects", study.ladder.model.effects, "Effects of the fitted model.", describe_effect);
  describe(record, result.found);
  record.field("next", result.next, "What to log or fly next, the most telling first.");
  record.may_fields(result.changes.has_value(),
                    [&](Record& r) { describe_changes(r, result.changes.value_or(Changes{})); });
}

StudyResult study_result(const identification::Study& study, const residuals::ForceUnit& unit,
                         const std::string& next_command) {
  const residuals::FailingPlace left = residuals::failing_place(study.after.all, unit);
  return {study,
          diagnosed({study.diagnosis}),
          residuals::failing_place(study.before.all, unit),
          left,
          prediction_of(study.before.predictions),
          prediction_of(study.after.predictions),
          causes_of(study.ladder),
          next_flights(study.diagnosis, left.where != residuals::FailingPlace::Where::kNowhere),
          next_command,
          std::nullopt};
}

}  // namespace swarmcert::analysis
