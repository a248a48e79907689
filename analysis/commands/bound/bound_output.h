/// @file The bounds of `bound`: described, and as text.
#pragma once

#include <string>

#include "analysis/commands/shared/tracking_input.h"
#include "nn/base/record.h"
#include "stability/bounds/tracking_bounds.h"

namespace swarmcert::analysis {

/// Describes the four gains as fields.
void describe_norms(files::Record& record, const stability::GainNorms& norms);

/// Formats a number with six digits; "-" if it is not finite.
std::string cell(double value);

struct ErrorAtTime {
  double t_s = 0;
  double error_m = 0;
};
void describe(files::Record& record, const ErrorAtTime& point);

/// What follows from gains, model and disturbance alone.
struct TrackingResult {
  double mass_kg = 0, thrust_scale = 1;  ///< of the vehicle
  stability::DisturbanceSource source;
  stability::TrackingReport report;
};
void describe(files::Record& record, const TrackingResult& result);

/// Prints the hypotheses, the gains, the bounds and which bound is smallest.
void print_tracking(const Tracking& input, const stability::DisturbanceSource& source,
                    const stability::TrackingReport& report);

}  // namespace swarmcert::analysis

namespace swarmcert::stability {

void describe(files::Record& record, const Assumption& assumption);

}  // namespace swarmcert::stability
