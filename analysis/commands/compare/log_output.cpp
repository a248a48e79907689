#include "analysis/commands/compare/log_output.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "analysis/commands/shared/plausibility_output.h"

namespace swarmcert::analysis {
namespace {

using residuals::Comparison;
using residuals::TrackErrors;

struct Clocks {
  int reference = 0, absolute = 0, estimated = 0, unknown = 0;
  double largest_s = 0;  ///< largest estimated offset
};

Clocks clocks_of(const Comparison& comparison) {
  Clocks clocks;
  for (const TrackErrors& track : comparison.tracks) {
    if (track.has_reference_clock)
      ++clocks.reference;
    else if (track.has_absolute_clock)
      ++clocks.absolute;
    else if (track.clock_onsets > 0)
      ++clocks.estimated;
    else
      ++clocks.unknown;
    if (!track.has_absolute_clock)
      clocks.largest_s = std::max(clocks.largest_s, std::abs(track.clock_offset_s));
  }
  return clocks;
}

void print_clocks(const Comparison& comparison) {
  const Clocks clocks = clocks_of(comparison);
  const int others = clocks.absolute + clocks.estimated + clocks.unknown;
  if (others == 0) {
    fmt::print("Clocks: one log per flight, none to relate.\n");
    return;
  }
  if (clocks.absolute > 0)
    fmt::print(
        "Clocks: {} of {} logs have absolute times, or their file, in common with the first of their "
        "flight.\n",
        clocks.absolute, others);
  if (clocks.estimated > 0) {
    fmt::print(
        "Clocks: offsets of {} of {} logs estimated against the first of their flight, up to {:.1f} ms.\n",
        clocks.estimated, others, 1000 * clocks.largest_s);
  }
  if (clocks.unknown > 0) {
    fmt::print(
        "Clocks: the offset of {} log{} could not be estimated and is taken as 0: no commanded movement "
        "starts within 0.1 s of one in the first log of the flight.\n",
        clocks.unknown, clocks.unknown == 1 ? "" : "s");
  }
}

}  // namespace

void describe_clocks(files::Record& record, const Comparison& comparison) {
  const Clocks clocks = clocks_of(comparison);
  record.field("reference", clocks.reference, "First of their flight.");
  record.field("absolute", clocks.absolute, "With absolute times, or in the file of the first.");
  record.field("estimated", clocks.estimated, "By common starts of commanded movements.");
  record.field("unknown", clocks.unknown, "Taken as synchronous.");
}

const char* clock_of(const TrackErrors& track) {
  if (track.has_absolute_clock) return "absolute";
  return track.has_reference_clock ? "reference" : track.clock_onsets > 0 ? "estimated" : "unknown";
}

void print_cuts(const Comparison& comparison) {
  std::array<std::size_t, static_cast<std::size_t>(residuals::Cut::kCount)> sums{};
  for (const TrackErrors& track : comparison.tracks) {
    for (std::size_t k = 0; k < sums.size(); ++k) sums[k] += track.cut[k];
  }
  fmt::print("Records cut:");
  bool any = false;
  for (std::size_t k = 1; k < sums.size(); ++k) {
    if (sums[k] == 0) continue;
    fmt::print("{} {} {}", any ? "," : "", sums[k], residuals::name(static_cast<residuals::Cut>(k)));
    any = true;
  }
  fmt::print("{}. ", any ? "" : " none");
  print_clocks(comparison);
}

void print_doubts(const Comparison& comparison) {
  std::vector<std::string> implausible;
  for (const TrackErrors& track : comparison.tracks) {
    if (!track.is_sound) fmt::print("damaged: {}: {}\n", track.path, fmt::join(track.findings, "; "));
    for (const logs::Doubt& doubt : track.doubts) {
      if (!doubt.refuses_force) implausible.push_back(track.path + ": " + doubt.words);
    }
  }
  for (const std::string& line : few_of_each(implausible)) fmt::print("implausible: {}\n", line);
}

}  // namespace swarmcert::analysis
