/// @file Result of `bound` as JSON and as text.
#pragma once

#include "analysis/commands/shared/tracking_input.h"
#include "nn/base/json_number.h"
#include "stability/bounds/tracking_bounds.h"

namespace swarmcert::analysis {

using files::finite;

files::Json norms_json(const stability::GainNorms& norms);

/// Six digits; "-" for a number that is not finite.
std::string cell(double value);

/// The members of the result after its head.
void add_tracking_json(files::Json& result, const Tracking& input, const stability::DisturbanceSource& source,
                       const stability::TrackingReport& report);

/// The table a controls engineer wants: hypotheses, gains, bounds and which of them is smallest.
void print_tracking(const Tracking& input, const stability::DisturbanceSource& source,
                    const stability::TrackingReport& report);

}  // namespace swarmcert::analysis
