#include "analysis/commands/diagnose/diagnose_result.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "analysis/commands/diagnose/balance_output.h"
#include "analysis/commands/diagnose/each_output.h"
#include "analysis/commands/diagnose/remainder_output.h"
#include "analysis/commands/diagnose/rotor_output.h"
#include "nn/base/text.h"

namespace swarmcert::analysis {
namespace {

using files::Record;
using identification::Diagnosis;
using identification::Missing;
using identification::ThrustScale;

constexpr const char* kDetectableMeaning =
    "the smallest size with which 90 % of flights like these would have named the effect (open loop: the "
    "flight does not react); null: not at any size within the physical bounds; nothing_missing means none "
    "above these sizes, and nothing left above three times the noise floor";

InstrumentResult shown(const identification::InstrumentedValue& value, double beyond) {
  InstrumentResult result = {value};
  result.value.least_squares += beyond;
  result.value.instrument += beyond;
  result.value.interval = {beyond + value.interval.lower, beyond + value.interval.upper};
  return result;
}

Ranked ranked(const Missing& missing) {
  const identification::Finding& finding = missing.finding;
  Ranked entry;
  entry.effect = missing.effect;
  entry.kind = missing.kind;
  entry.rmse_before_N = finding.rmse_before_N;
  entry.rmse_after_N = finding.rmse_after_N;
  entry.drop = 1 - finding.rmse_after_N / finding.rmse_before_N;
  entry.drop_interval = finding.drop_interval;
  entry.parameters = fitted_values(missing.effect, missing.parameters, missing.intervals);
  entry.per_vehicle = !missing.specs.empty() && !missing.specs[0].vehicle.empty();
  for (std::size_t c = 0; c < missing.coefficients.size(); ++c) {
    const std::string& name = missing.coefficients[c];
    const double beyond = shown_beyond_file(missing.effect, name);
    if (c < finding.model_form.size())
      entry.model_form[name] = {beyond + finding.model_form[c].lower, beyond + finding.model_form[c].upper};
    if (c < missing.instrument.size()) entry.instrument[name] = shown(missing.instrument[c], beyond);
  }
  entry.equivalence_class = missing.equivalence_class;
  if (missing.equivalence_class.find(" / ") != std::string::npos)
    entry.never_told_apart = files::split_at(missing.equivalence_class, " / ");
  for (const identification::Rival& rival : finding.rivals) {
    entry.equivalence_class += " / " + rival.effect;
    entry.rivals.push_back({{rival.effect}, rival.odds, rival.excitation});
  }
  entry.separated_by = missing.excitation;
  entry.paired_z = finding.paired_z;
  entry.wald_z = finding.wald_z;
  entry.evidence_bits = finding.evidence_bits;
  entry.records = finding.support.records;
  entry.blocks = finding.support.blocks;
  entry.flights = static_cast<std::size_t>(finding.support.flights);
  entry.is_sensor = is_sensor_error(missing.effect);
  return entry;
}

std::vector<Ranked> ranked(const std::vector<Missing>& all, const std::string& vehicle) {
  std::vector<Ranked> entries;
  for (const Missing& missing : all) {
    entries.push_back(ranked(missing));
    if (!vehicle.empty()) entries.back().vehicle = vehicle;
  }
  return entries;
}

void describe_unexplained(Record& record, const std::vector<Diagnosis>& diagnoses) {
  bool flag = false;
  double ratio = 0;
  std::vector<std::string> depends_on;
  for (const Diagnosis& diagnosis : diagnoses) {
    const identification::Remainder& rest = diagnosis.remainder;
    flag = flag || rest.stands_out();
    ratio = std::max(ratio, rest.ratio);
    depends_on.insert(depends_on.end(), rest.depends_on.begin(), rest.depends_on.end());
  }
  record.field("flag", flag, "");
  record.field("ratio", ratio, "Power at low frequencies over that of the noise floor.", "", "estimate");
  record.field("depends_on", depends_on, "Variables that it varies with; vibration.");
}

void describe_kind(Record& record, const Diagnosis& diagnosis) {
  record.field("kind", diagnosis.kind, "");
  record.field("records", diagnosis.records, "");
  record.field("blocks", diagnosis.blocks, "Of 2 s.");
  record.field("searched_blocks", diagnosis.searched_blocks, "In which effects were searched.");
  record.field("flights", diagnosis.flights, "");
  record.field("rmse_before", diagnosis.rmse_before_N, "Of held-out blocks, without what is named.", "N",
               "estimate");
  record.field("rmse_after", diagnosis.rmse_after_N, "Of held-out blocks, with what is named.", "N",
               "estimate");
  record.field("too_poor", diagnosis.too_poor, "Why there is no answer; empty if there is one.");
  record.field("suspected", diagnosis.suspected, "They fit, but are not named.");
  record.field("at_bound", diagnosis.at_bound, "Of those: a value ended at its bound.");
  const ThrustScale& scale = diagnosis.thrust_scale;
  record.may_object(scale.is_known, "thrust_scale", "Factor of the thrust beside everything that is named.",
                    [&](Record& r) {
                      const InstrumentResult beyond = shown(scale.value, 1);
                      r.field("least_squares", beyond.value.least_squares, "By least squares.", "",
                              "estimate");
                      r.field("instrument", beyond.value.instrument, "By set points.", "", "estimate");
                      r.field("interval_90", beyond.value.interval, "Of `instrument`.");
                      r.field("difference_z", beyond.value.difference_z, "");
                    });
}

struct DetectableOfKind {
  evidence::Detectable entry;
  std::string kind;
};

void describe_detectable(Record& record, const DetectableOfKind& one) {
  record.field("effect", one.entry.effect, "");
  record.field("kind", one.kind, "");
  record.field("parameter", one.entry.parameter, "");
  record.field("size", one.entry.size, "Smallest that these flights show; null: none.", "", "estimate");
  record.field("shape", one.entry.shape, "Of the effect of this size.");
  record.field("excitation", one.entry.excitation, "Flights that would show smaller ones.");
}

void describe_vehicle_difference(Record& record, const identification::Difference& difference) {
  record.field("vehicle", difference.vehicle, "");
  record.field("kind", difference.diagnosis.kind, "");
  record.field("same_vehicle", difference.against_itself, "The others are its own flights.");
  record.list("held", difference.held, "Effects fitted to the other flights, which are held.",
              describe_effect);
  record.field("grouped_by", difference.grouped_by, "folder or flight.");
  record.field("groups", difference.own_groups, "");
  record.field("other_groups", difference.other_groups, "");
  record.field("scatter_known", difference.no_scatter.empty(), "");
  record.field("within_scatter", ranked(difference.within_scatter, ""),
               "Found, but no larger than the other flights differ among themselves.");
}

}  // namespace

Judgement judgement_of(const std::vector<Diagnosis>& diagnoses) {
  Judgement judgement;
  judgement.verdict = identification::verdict_of(diagnoses, judgement.reason);
  for (const Diagnosis& diagnosis : diagnoses) {
    std::vector<Ranked> entries = ranked(diagnosis.ranking, diagnosis.vehicle);
    std::move(entries.begin(), entries.end(), std::back_inserter(judgement.ranking));
  }
  return judgement;
}

Diagnosed diagnosed(std::vector<Diagnosis> diagnoses) {
  Diagnosed found;
  found.judgement = judgement_of(diagnoses);
  for (const Diagnosis& diagnosis : diagnoses) {
    for (const std::string& problem : diagnosis.problems)
      if (std::find(found.problems.begin(), found.problems.end(), problem) == found.problems.end())
        found.problems.push_back(problem);
  }
  found.diagnoses = std::move(diagnoses);
  return found;
}

void describe(Record& record, const Diagnosed& found) {
  describe(record, found.judgement);
  record.object("unexplained", "Whether something is left that no effect explains.",
                [&](Record& r) { describe_unexplained(r, found.diagnoses); });
  describe_remainder(record, found.diagnoses);
  std::vector<DetectableOfKind> detectable;
  for (const Diagnosis& diagnosis : found.diagnoses)
    for (const evidence::Detectable& entry : diagnosis.detectable)
      detectable.push_back({entry, diagnosis.kind});
  record.list("detectable", detectable, "The smallest size of each effect that these flights would show.",
              describe_detectable);
  record.field("detectable_meaning", kDetectableMeaning, "What a size in `detectable` means.");
  record.list("kinds", found.diagnoses, "Per kind of vehicle.", describe_kind);
  record.field("problems", found.problems, "What could not be used, and why.");
  const std::string& reason = found.judgement.reason;
  record.may("reason", reason.empty() ? std::nullopt : std::optional(reason), "Why there is no answer.");
}

void describe(Record& record, const Against& against) {
  record.field("flights", against.flights, "Files.");
  record.list("vehicles", against.differences, "", describe_vehicle_difference);
}

void describe(Record& record, const DiagnoseResult& result) {
  record.may("fails", result.fails, "Where the given model fails, in one line; absent with --against.");
  describe(record, result.found);
  record.may("against", result.against, "With --against: what the ranking is the difference from.");
  record.may_fields(result.rotors.has_value(), [&](Record& r) {
    r.list("rotors", result.rotors.value_or(std::vector<identification::RotorBalance>{}),
           "With --against: per vehicle, and per flight, what each rotor gives in slow flight.",
           describe_rotors);
  });
  record.may_fields(result.torques.has_value(), [&](Record& r) {
    r.list("torque_balance", result.torques.value_or(std::vector<identification::TorqueBalance>{}),
           "Per vehicle, what its rotors balance on average.", describe_torques);
  });
  record.may_fields(result.sensors.has_value(), [&](Record& r) {
    r.list("sensors", result.sensors.value_or(std::vector<identification::AccelerometerBalance>{}),
           "Per vehicle, its accelerometer against its velocity.", describe_accelerometer);
  });
  record.may_fields(result.each.has_value(), [&](Record& r) {
    describe_each(r, result.each.value_or(std::vector<identification::Each>{}));
  });
  record.may("next", result.next, "With --next: what to fly next.");
}

}  // namespace swarmcert::analysis
