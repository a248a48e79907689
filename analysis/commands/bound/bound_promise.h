/// @file `bound --from compare.json --coverage P`: a bound for a further flight.
#pragma once

#include <string>
#include <vector>

#include "analysis/commands/shared/tracking_input.h"
#include "analysis/tracking/flight_promise.h"
#include "stability/bounds/tracking_bounds.h"

namespace swarmcert::analysis {

struct CoverageBound {
  double level = 0;
  std::size_t flights = 0, vehicles = 0;
  std::vector<std::string> made_from;  ///< SHA-256 of every file that compare read, logs included
  std::vector<PromisedBound> bounds;   ///< one per row of bounds[]
};
void describe(files::Record& record, const CoverageBound& promise);

/// @param declared bias and estimation errors given in addition to the file.
/// @param from result of compare.
/// @throws files::InputError if it has fewer flights than the level needs.
CoverageBound promise_of(const Tracking& input, const stability::TrackingReport& report,
                         const stability::DisturbanceSource& declared, const stability::InitialError& initial,
                         const std::string& from, double level);
void print(const CoverageBound& promise);

}  // namespace swarmcert::analysis
