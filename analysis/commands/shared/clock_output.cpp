#include "analysis/commands/shared/clock_output.h"

#include <fmt/core.h>

#include <utility>

namespace swarmcert::analysis {
namespace {

using identification::ClockOffset;

Ranked ranked_offset(const ClockOffset& offset) {
  Ranked entry;
  entry.effect = "clock_offset";
  entry.kind = offset.kind;
  entry.vehicle = offset.vehicle;
  entry.against = offset.against_vehicle;
  entry.rmse_before_N = offset.rmse_before_N;
  entry.rmse_after_N = offset.rmse_after_N;
  entry.drop = 1 - offset.rmse_after_N / offset.rmse_before_N;
  entry.parameters["offset_s"] = {offset.offset_s, offset.interval};
  entry.equivalence_class = "clock offset";
  entry.separated_by = "passes in which each vehicle disturbs the other";
  entry.paired_z = offset.z;
  entry.records = entry.blocks = offset.records;
  entry.flights = 1;
  entry.statement = identification::in_words(offset);
  entry.is_sensor = true;
  return entry;
}

}  // namespace

std::string sentence(const ClockOffset& offset) {
  std::string words = identification::in_words(offset) + "; all else was judged with it corrected";
  words[0] = 'T';
  return words + ".";
}

std::vector<Ranked> ranked(const std::vector<ClockOffset>& offsets) {
  std::vector<Ranked> entries;
  for (const ClockOffset& offset : offsets) entries.push_back(ranked_offset(offset));
  return entries;
}

void describe_clock(files::Record& record, const ClockOffset& offset) {
  record.field("flight", offset.flight, "");
  record.field("log", offset.path, "");
  record.field("vehicle", offset.vehicle, "");
  record.field("against", offset.against_vehicle, "The vehicle whose clock it is compared with.");
  record.field("offset_s", offset.offset_s, "How far its clock is ahead.", "s", "estimate");
  record.field("interval_90", offset.interval, "", "s");
  record.field("statement", record.is_shape() ? "" : identification::in_words(offset), "It in words.");
}

void print_clock_offsets(const std::vector<ClockOffset>& offsets) {
  for (const ClockOffset& offset : offsets) fmt::print("  {}\n", sentence(offset));
}

}  // namespace swarmcert::analysis
