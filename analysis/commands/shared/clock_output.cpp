#include "analysis/commands/shared/clock_output.h"

#include <fmt/core.h>

#include "analysis/commands/shared/log_faults.h"

namespace swarmcert::analysis {
namespace {

using identification::ClockOffset;

files::Json ranking_entry_of(const ClockOffset& offset) {
  return fault_entry(
      {{"effect", "clock_offset"},
       {"kind", offset.kind},
       {"vehicle", offset.vehicle},
       {"against", offset.against_vehicle},
       {"rmse_before", offset.rmse_before_N},
       {"rmse_after", offset.rmse_after_N},
       {"drop", 1 - offset.rmse_after_N / offset.rmse_before_N},
       {"parameters", {{"offset_s", {{"value", offset.offset_s}, {"interval_90", offset.interval}}}}},
       {"class", "clock offset"},
       {"confounded_with", files::Json::array()},
       {"rivals", files::Json::array()},
       {"separated_by", "passes in which each vehicle disturbs the other"},
       {"paired_z", offset.z},
       {"records_in_support", offset.records},
       {"blocks_in_support", offset.records},
       {"flights_in_support", 1},
       {"statement", identification::in_words(offset)}});
}

void print_all(const std::vector<ClockOffset>& offsets) {
  for (const ClockOffset& offset : offsets) fmt::print("  {}\n", sentence(offset));
}

}  // namespace

std::string sentence(const ClockOffset& offset) {
  std::string words = identification::in_words(offset) + "; all else was judged with it corrected";
  words[0] = 'T';
  return words + ".";
}

void add_clocks(const std::vector<ClockOffset>& offsets, bool prints, files::Json& result) {
  result["clock_offsets"] = files::Json::array();
  for (const ClockOffset& offset : offsets) {
    result["clock_offsets"].push_back({{"flight", offset.flight},
                                       {"log", offset.path},
                                       {"vehicle", offset.vehicle},
                                       {"against", offset.against_vehicle},
                                       {"offset_s", offset.offset_s},
                                       {"interval_90", offset.interval},
                                       {"statement", identification::in_words(offset)}});
  }
  if (prints) print_all(offsets);
}

bool judge_clocks(const std::vector<ClockOffset>& offsets, bool prints, files::Json& result) {
  std::vector<files::Json> entries;
  for (const ClockOffset& offset : offsets) entries.push_back(ranking_entry_of(offset));
  if (prints) print_all(offsets);
  return rank_faults(entries, result);
}

}  // namespace swarmcert::analysis
