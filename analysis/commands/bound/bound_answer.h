/// @file The answer with which `bound` begins: does this loop fly, and how large can its error become?
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "analysis/commands/shared/tracking_input.h"
#include "nn/base/record.h"
#include "stability/bounds/tracking_bounds.h"

namespace swarmcert::analysis {

struct BoundAnswer {
  /// True: the loop that flies is stable and every condition is proved or declared. False: it diverges, or a declared
  /// input breaks a condition. Nothing: undecided.
  std::optional<bool> flies;
  /// Largest error for all that was declared, per axis; nothing without a bound, or if the loop does not fly.
  std::optional<double> error_m[3];
  std::vector<stability::Assumption> conditions;
  std::vector<std::string> limits;  ///< what limits the loop or the answer, with numbers
  std::string change;               ///< what would change the answer; empty: nothing
};

/// @param report with float32_m set.
BoundAnswer bound_answer(const Tracking& input, const stability::DisturbanceSource& source,
                         const stability::InitialError& initial, const stability::TrackingReport& report);

void describe(files::Record& record, const BoundAnswer& answer);
/// Prints at most six lines.
void print_answer(const Tracking& input, const BoundAnswer& answer);
/// Returns kDone, kViolated or kInconclusive.
int exit_code(const BoundAnswer& answer);

}  // namespace swarmcert::analysis
