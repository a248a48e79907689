#include "analysis/commands/diagnose/diagnose_report.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "analysis/cli/command_line.h"
#include "analysis/cli/counted.h"
#include "analysis/commands/diagnose/diagnose_output.h"
#include "analysis/commands/diagnose/each_output.h"
#include "analysis/commands/diagnose/remainder_output.h"
#include "analysis/commands/shared/effect_output.h"
#include "analysis/report/report.h"

namespace swarmcert::analysis {
namespace {

using identification::Diagnosis;
using identification::Missing;

double drop(const Missing& missing) {
  return 1 - missing.finding.rmse_after_N / missing.finding.rmse_before_N;
}

std::string joined(const std::vector<std::string>& words) {
  return fmt::format("{}", fmt::join(words, ", "));
}

std::string values_of(const Missing& missing) {
  std::vector<std::string> values;
  for (const auto& [name, value] : missing.parameters) {
    const std::string interval = interval_words(missing.effect, name, missing.intervals);
    values.push_back(fmt::format("{} = {:.4g}", name, shown_beyond_file(missing.effect, name) + value));
    if (!interval.empty()) values.back() += " (" + interval + ")";
  }
  return joined(values);
}

}  // namespace

void add_ranking(Report& report, const Diagnosis& diagnosis, const std::string& name,
                 const residuals::ForceUnit& unit) {
  std::vector<std::vector<std::string>> rows;
  std::vector<Bar> bars;
  for (const Missing& missing : diagnosis.ranking) {
    const identification::Finding& finding = missing.finding;
    const bool each = !missing.specs.empty() && !missing.specs[0].vehicle.empty();
    rows.push_back({missing.effect + (each ? " of each vehicle" : ""),
                    fmt::format("{:.4g} -> {:.4g}", unit.per_newton() * finding.rmse_before_N,
                                unit.per_newton() * finding.rmse_after_N),
                    fmt::format("{:.1f} % ({:.1f} .. {:.1f})", 100 * drop(missing),
                                100 * finding.drop_interval.lower, 100 * finding.drop_interval.upper),
                    values_of(missing),
                    missing.equivalence_class == missing.effect ? "" : missing.equivalence_class,
                    joined(finding.confounded_with()), missing.excitation});
    const double of_given = 100 * finding.rmse_before_N / diagnosis.rmse_before_N;
    bars.push_back({missing.effect, of_given * drop(missing), of_given * finding.drop_interval.lower,
                    of_given * finding.drop_interval.upper});
  }
  report.table({"effect", std::string("RMSE [") + unit.name + "]", "fall, 90 %", "values, 90 %",
                "flights cannot tell apart", "these flights cannot tell it from", "what separates them"},
               rows);
  // Users choose the names of kinds, so figures are numbered.
  report.bars(name, bars, "fall of the error [% of the given model's]",
              "How far each effect lowers the cross-validated error when it is added to those above it, in "
              "percent of the error of the given model, with 90 % intervals from resampled blocks.");
}

void add_left(Report& report, const Diagnosis& diagnosis, const residuals::ForceUnit& unit) {
  for (const std::string& sentence : left_sentences(diagnosis, unit)) report.paragraph(sentence);
  add_detectable(report, diagnosis);
}

void add_detectable(Report& report, const Diagnosis& diagnosis) {
  report.paragraph(std::string(kDetectableWords) + " (open loop: the flight does not react):");
  std::vector<std::vector<std::string>> rows;
  const bool all_show =
      std::all_of(diagnosis.detectable.begin(), diagnosis.detectable.end(),
                  [](const evidence::Detectable& entry) { return std::isfinite(entry.size); });
  for (const evidence::Detectable& entry : diagnosis.detectable) {
    const bool shows = std::isfinite(entry.size);
    rows.push_back({entry.effect, entry.parameter,
                    shows ? fmt::format("{:.3g}", entry.size) : "not at any size",
                    shows ? "" : entry.excitation});
    if (all_show) rows.back().pop_back();
  }
  std::vector<std::string> header = {"effect", "number", "size", "what would show it"};
  if (all_show) header.pop_back();
  report.table(header, rows);
}

std::string write_diagnose_report(const std::vector<Diagnosis>& diagnoses,
                                  const std::vector<identification::Difference>& differences,
                                  const std::vector<identification::Each>& each,
                                  const std::vector<std::string>& notes, const residuals::ForceUnit& unit,
                                  const files::Json& result, const std::string& folder, bool overwrite) {
  Report report(differences.empty() ? "Which physical effect is missing" : "What changed");
  report.made_by(command_to_copy());
  report.result(result);
  for (const std::string& note : notes) report.paragraph(note);
  for (std::size_t i = 0; i < diagnoses.size(); ++i) {
    const Diagnosis& diagnosis = diagnoses[i];
    report.heading(diagnosis.vehicle.empty() ? "Vehicles of kind " + diagnosis.kind
                                             : "Vehicle " + diagnosis.vehicle);
    report.paragraph(fmt::format("{} records of {}, {} blocks of 2 s.", diagnosis.records,
                                 counted(diagnosis.flights, "flight"), diagnosis.blocks));
    if (!diagnosis.too_poor.empty()) {
      report.paragraph("No answer: " + diagnosis.too_poor + ".");
      continue;
    }
    if (!differences.empty()) report.paragraph(in_words(differences[i]));
    if (diagnosis.ranking.empty())
      report.paragraph(no_effect_words(diagnosis));
    else
      add_ranking(report, diagnosis, "ranking_" + std::to_string(i + 1), unit);
    add_left(report, diagnosis, unit);
    add_remainder(report, diagnosis, i + 1, unit);
  }
  for (std::size_t i = 0; i < each.size(); ++i) {
    report.heading("Flight by flight");
    add_each(report, each[i], i + 1);
  }
  return report.write(folder, overwrite);
}

}  // namespace swarmcert::analysis
