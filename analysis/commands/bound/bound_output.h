/// @file The result of `bound` as JSON and as text.
#pragma once

#include "analysis/commands/shared/tracking_input.h"
#include "nn/base/json_number.h"
#include "nn/base/record.h"
#include "stability/bounds/tracking_bounds.h"

namespace swarmcert::analysis {

using files::finite;

/// Describes the four gains as fields.
void describe_norms(files::Record& record, const stability::GainNorms& norms);

/// Formats a number with six digits; "-" if it is not finite.
std::string cell(double value);

/// Adds the members of the result that follow its head.
void add_tracking_json(files::Json& result, const Tracking& input, const stability::DisturbanceSource& source,
                       const stability::TrackingReport& report);

/// Prints the hypotheses, the gains, the bounds and which bound is smallest.
void print_tracking(const Tracking& input, const stability::DisturbanceSource& source,
                    const stability::TrackingReport& report);

}  // namespace swarmcert::analysis
