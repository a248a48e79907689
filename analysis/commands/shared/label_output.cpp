#include "analysis/commands/shared/label_output.h"

#include <fmt/core.h>

namespace swarmcert::analysis {
namespace {

using identification::Mislabelled;

FittedValues misfits_of(const Mislabelled& label) {
  const std::string unit = label.what == Mislabelled::What::kSetPoints ? "m" : "m_s2";
  return {{"misfit_" + unit, {label.after, {}}}, {"misfit_as_labelled_" + unit, {label.before, {}}}};
}

/// Force error in newton; unknown if no force is compared.
double force_of(const Mislabelled& label, double misfit) {
  if (label.what == Mislabelled::What::kSetPoints || !(label.mass_kg > 0)) return kUnknown;
  return label.mass_kg * misfit;
}

Ranked ranked_label(const Mislabelled& label) {
  constexpr const char* kScale = "the vehicle on a scale";
  Ranked entry;
  entry.effect = "mislabelled";
  entry.kind = label.kind;
  entry.vehicle = label.vehicle;
  entry.against = label.belongs_to;
  entry.rmse_before_N = force_of(label, label.before);
  entry.rmse_after_N = force_of(label, label.after);
  entry.drop = 1 - label.after / label.before;
  entry.parameters = misfits_of(label);
  entry.equivalence_class = label.is_sure ? "mislabelled" : "mislabelled, thrust ratio or mass";
  if (!label.is_sure) {
    for (const char* const rival : {"thrust_ratio", "payload", "constant_force"})
      entry.rivals.push_back({{rival}, kUnknown, kScale});
    entry.separated_by = kScale;
  }
  entry.blocks = static_cast<std::size_t>(label.blocks);
  entry.flights = static_cast<std::size_t>(label.flights);
  entry.statement = identification::in_words(label);
  entry.is_sensor = true;
  return entry;
}

bool is_corrected(const Mislabelled& label) {
  return label.is_sure && (label.what == Mislabelled::What::kName || label.what == Mislabelled::What::kKind);
}

}  // namespace

std::string sentence(const Mislabelled& label) {
  const bool is_left_out = label.what == Mislabelled::What::kKind && !label.path.empty();
  return identification::in_words(label) +
         (!is_corrected(label) ? "; all else was judged with the logs as they are: correct them first."
          : is_left_out        ? "; all else was judged without this log."
                               : "; all else was judged with it corrected.");
}

std::vector<Ranked> ranked(const std::vector<Mislabelled>& labels) {
  std::vector<Ranked> entries;
  for (const Mislabelled& label : labels) entries.push_back(ranked_label(label));
  return entries;
}

void describe_label(files::Record& record, const Mislabelled& label) {
  record.field("vehicle", label.vehicle, "");
  record.field("belongs_to", label.belongs_to, "The vehicle whose log it is.");
  record.field("flight", label.flight, "");
  record.field("is_sure", label.is_sure, "");
  record.field("statement", record.is_shape() ? "" : identification::in_words(label), "It in words.");
}

void print_mislabelled(const std::vector<Mislabelled>& labels) {
  for (const Mislabelled& label : labels) fmt::print("  Mislabelled: {}\n", sentence(label));
}

}  // namespace swarmcert::analysis
