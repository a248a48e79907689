/// @file `bound --verified`: rigorous enclosures of the gains.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "analysis/commands/shared/tracking_input.h"
#include "stability/bounds/enclosures/verified_norms.h"
#include "stability/bounds/tracking_bounds.h"

namespace swarmcert::analysis {

/// Gains of one loop.
struct VerifiedRow {
  int axis = 0;
  const char* input = "";  ///< force, command, velocity or position: where the disturbance enters
  stability::Loop loop = stability::Loop::kContinuous;
  std::optional<stability::VerifiedNorms> norms;  ///< of a sampled loop at its samples; empty: not proved
  std::optional<stability::VerifiedNorms> between_samples;
  std::optional<double> delay_gain;  ///< of a continuous loop with a delay
  std::string why;                   ///< reason if not proved
};

using VerifiedGains = std::vector<VerifiedRow>;
void describe(files::Record& record, const VerifiedRow& row);

/// Encloses the gains per axis, input and loop. A loop that could not be proved stable has no enclosure, and its row
/// says so.
VerifiedGains verified_gains(const Tracking& input);
void print(const VerifiedGains& verified);

}  // namespace swarmcert::analysis
