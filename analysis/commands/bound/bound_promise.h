/// @file `bound --from compare.json --coverage P`: a bound for a further flight, as JSON and as text.
#pragma once

#include <string>

#include "analysis/commands/shared/tracking_input.h"
#include "stability/bounds/tracking_bounds.h"

namespace swarmcert::analysis {

/// Returns `coverage` of the result: level, flights, interval, the statement of the promise, and the bound of every
/// row of bounds[].
/// @param declared bias and estimation errors given in addition to the file.
/// @param from result of compare.
/// @throws files::InputError if it has fewer flights than the level needs.
files::Json promise_json(const Tracking& input, const stability::TrackingReport& report,
                         const stability::DisturbanceSource& declared, const stability::InitialError& initial,
                         const std::string& from, double level);

void print_promise(const files::Json& promise);

}  // namespace swarmcert::analysis
