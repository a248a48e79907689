#include "analysis/commands/shared/label_output.h"

#include <fmt/core.h>

#include "analysis/commands/shared/log_faults.h"

namespace swarmcert::analysis {
namespace {

using identification::Mislabelled;

files::Json parameters_of(const Mislabelled& label) {
  const char* const unit = label.what == Mislabelled::What::kSetPoints ? "m" : "m_s2";
  return {{fmt::format("misfit_{}", unit), {{"value", label.after}}},
          {fmt::format("misfit_as_labelled_{}", unit), {{"value", label.before}}}};
}

/// Force error in newton; null if no force is compared.
files::Json force_of(const Mislabelled& label, double misfit) {
  if (label.what == Mislabelled::What::kSetPoints || !(label.mass_kg > 0)) return nullptr;
  return label.mass_kg * misfit;
}

files::Json ranking_entry_of(const Mislabelled& label) {
  const std::vector<std::string> rivals =
      label.is_sure ? std::vector<std::string>{}
                    : std::vector<std::string>{"thrust_ratio", "payload", "constant_force"};
  files::Json entry =
      fault_entry({{"effect", "mislabelled"},
                   {"kind", label.kind},
                   {"vehicle", label.vehicle},
                   {"against", label.belongs_to},
                   {"rmse_before", force_of(label, label.before)},
                   {"rmse_after", force_of(label, label.after)},
                   {"drop", 1 - label.after / label.before},
                   {"parameters", parameters_of(label)},
                   {"class", label.is_sure ? "mislabelled" : "mislabelled, thrust ratio or mass"},
                   {"confounded_with", rivals},
                   {"rivals", files::Json::array()},
                   {"separated_by", label.is_sure ? "" : "the vehicle on a scale"},
                   {"paired_z", nullptr},
                   {"records_in_support", 0},
                   {"blocks_in_support", label.blocks},
                   {"flights_in_support", label.flights},
                   {"statement", identification::in_words(label)}});
  for (const std::string& rival : rivals)
    entry["rivals"].push_back({{"effect", rival}, {"fly", "the vehicle on a scale"}});
  return entry;
}

bool is_corrected(const Mislabelled& label) {
  return label.is_sure && (label.what == Mislabelled::What::kName || label.what == Mislabelled::What::kKind);
}

void print_all(const std::vector<Mislabelled>& labels) {
  for (const Mislabelled& label : labels) fmt::print("  Mislabelled: {}\n", sentence(label));
}

}  // namespace

std::string sentence(const Mislabelled& label) {
  const bool is_left_out = label.what == Mislabelled::What::kKind && !label.path.empty();
  return identification::in_words(label) +
         (!is_corrected(label) ? "; all else was judged with the logs as they are: correct them first."
          : is_left_out        ? "; all else was judged without this log."
                               : "; all else was judged with it corrected.");
}

void add_labels(const std::vector<Mislabelled>& labels, bool prints, files::Json& result) {
  result["mislabelled"] = files::Json::array();
  for (const Mislabelled& label : labels) {
    result["mislabelled"].push_back({{"vehicle", label.vehicle},
                                     {"belongs_to", label.belongs_to},
                                     {"flight", label.flight},
                                     {"is_sure", label.is_sure},
                                     {"statement", identification::in_words(label)}});
  }
  if (prints) print_all(labels);
}

bool judge_labels(const std::vector<Mislabelled>& labels, bool prints, files::Json& result) {
  std::vector<files::Json> entries;
  for (const Mislabelled& label : labels) entries.push_back(ranking_entry_of(label));
  if (prints) print_all(labels);
  return rank_faults(entries, result);
}

}  // namespace swarmcert::analysis
