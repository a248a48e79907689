/// @file `bound --tube`: how large the error can be at each time, from rest.
#pragma once

#include <string>
#include <vector>

#include "analysis/commands/bound/bound_output.h"

namespace swarmcert::analysis {

/// Bound of |e(t)| of one axis in the force channel of the continuous loop.
struct AxisTube {
  int axis = 0;
  std::string why;  ///< reason if there is none
  std::vector<ErrorAtTime> at;
};
void describe(files::Record& record, const AxisTube& tube);

/// @param count number of times, from 0 to 10 s.
std::vector<AxisTube> tubes_over_time(const Tracking& input, const stability::DisturbanceSource& source,
                                      int count);

}  // namespace swarmcert::analysis
