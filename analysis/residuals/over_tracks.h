/// @file One pass over all tracks of all flights, several flights at a time.
#pragma once

#include <algorithm>
#include <iterator>
#include <string>
#include <vector>

#include "analysis/residuals/inputs.h"
#include "nn/base/parallel.h"

namespace swarmcert::residuals {

/// Calls add(track, results) for each track and returns the results in the order of the flights. Position-only vehicles
/// are skipped, and problems with logs are not reported, because compare() does that.
template <typename Result, typename Add>
std::vector<Result> over_tracks(const Inputs& inputs, int jobs, const Add& add) {
  std::vector<std::vector<Result>> parts(inputs.found.flights.size());
  files::parallel_for(static_cast<int>(parts.size()), jobs, [&](int i) {
    const auto flight = static_cast<std::size_t>(i);
    std::vector<std::string> problems;
    for (const Track& track : inputs.load(flight, problems)) {
      if (!track.position_only) add(track, parts[flight]);
    }
  });
  std::vector<Result> all;
  for (std::vector<Result>& part : parts) std::move(part.begin(), part.end(), std::back_inserter(all));
  return all;
}

}  // namespace swarmcert::residuals
