#include "analysis/commands/shared/ranking.h"

#include <iterator>
#include <utility>

namespace swarmcert::analysis {
namespace {

using files::Record;
using identification::Verdict;

std::vector<std::string> names_of(const std::vector<Alternative>& rivals) {
  std::vector<std::string> names;
  for (const Alternative& rival : rivals) names.insert(names.end(), rival.names.begin(), rival.names.end());
  return names;
}

/// The class of the entry, which no flight can tell apart, then what these flights cannot tell apart.
std::vector<Alternative> alternatives_of(const Ranked& entry) {
  std::vector<Alternative> all;
  if (!entry.never_told_apart.empty()) all.push_back({entry.never_told_apart, 1, entry.separated_by});
  all.insert(all.end(), entry.rivals.begin(), entry.rivals.end());
  return all;
}

const char* set_points_verdict(const identification::InstrumentedValue& value) {
  if (!value.is_strong()) return "too_weak";
  return value.contradicts() ? "contradicts" : "agrees";
}

}  // namespace

void describe(Record& record, const InstrumentResult& result) {
  const identification::InstrumentedValue& value = result.value;
  record.field("least_squares", value.least_squares, "By least squares.", "", "estimate");
  record.field("instrument", value.instrument, "By instrumental variables: the set points.", "", "estimate");
  record.field("interval_90", value.interval, "Of `instrument`.");
  record.field("difference_z", value.difference_z, "Difference of both estimates over its standard error.");
  record.field("verdict", set_points_verdict(value), "too_weak, contradicts or agrees.");
}

void describe(Record& record, const Ranked& entry) {
  record.field("effect", entry.effect, "Name in model files, or of a fault of the log.");
  record.field("kind", entry.kind, "Kind of vehicle.");
  record.may("vehicle", entry.vehicle, "The one vehicle that this is about.");
  record.may("against", entry.against,
             "Of a clock, the vehicle it is compared with; of a label, whose it is.");
  record.field("rmse_before", entry.rmse_before_N, "Of held-out blocks, without it.", "N", "estimate");
  record.field("rmse_after", entry.rmse_after_N, "Of held-out blocks, with it.", "N", "estimate");
  record.field("drop", entry.drop, "1 - rmse_after / rmse_before.");
  record.field("drop_ci", entry.drop_interval, "90 % interval of drop.");
  record.field("parameters", entry.parameters, "Fitted values; units stand in the names.");
  record.field("per_vehicle", entry.per_vehicle, "Each vehicle has values of its own.");
  record.field("model_form", entry.model_form,
               "Range of each coefficient over fits without a part of the data.");
  record.field("instrument", entry.instrument, "The check of each coefficient by set points.");
  record.field(
      "evidence_bits", entry.evidence_bits,
      "Logarithm of the odds of the best explanation with it over the best without it. Of an effect "
      "that was not searched: from the Wald statistic, which is robust to errors correlated over 2 s, "
      "less what its parameters cost (Schwarz). null: not known.",
      "bit", "estimate");
  record.list("alternatives", alternatives_of(entry), "What could stand in its place.",
              [](Record& r, const Alternative& other) {
                r.field("names", other.names, "What no flight tells apart from each other.");
                r.field("odds", other.odds, "Over this entry; null: not known.", "", "estimate");
              });
  record.field("class", entry.equivalence_class, "What these flights cannot tell apart.");
  record.field("confounded_with", names_of(entry.rivals), "Effects that explain the data nearly as well.");
  record.list("rivals", entry.rivals, "The same, with what tells them apart.",
              [](Record& r, const Alternative& other) {
                r.field("effect", other.names.empty() ? "" : other.names[0], "Its name.");
                r.field("fly", other.fly, "Flights that would show it.");
              });
  record.field("separated_by", entry.separated_by, "Flights that would tell them apart.");
  record.field("paired_z", entry.paired_z, "Fall of the error over held-out blocks, in standard errors.");
  record.field("wald_z", entry.wald_z, "Size over its standard error.");
  record.field("records_in_support", entry.records, "Records that show it.");
  record.field("blocks_in_support", entry.blocks, "Blocks of 2 s that show it.");
  record.field("flights_in_support", entry.flights, "Flights that show it.");
  record.may("rotor", entry.rotor, "Number of the weak rotor, 1 .. 4.");
  record.may("statement", entry.statement, "It in words.");
  record.may("sensor", entry.is_sensor ? std::optional(true) : std::nullopt,
             "An error of a log, not a force on the vehicle.");
}

void Judgement::append(std::vector<Ranked> causes) {
  if (causes.empty()) return;
  ranking.insert(ranking.end(), std::make_move_iterator(causes.begin()),
                 std::make_move_iterator(causes.end()));
  if (verdict == Verdict::kInconclusive) return;
  verdict = Verdict::kMissingEffect;
}

void describe(Record& record, const Judgement& judgement) {
  record.field("verdict", judgement.verdict, "missing_effect: `ranking` names what is missing.");
  record.field("ranking", judgement.ranking, "What is missing, the largest fall of the error first.");
}

}  // namespace swarmcert::analysis
