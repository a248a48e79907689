/// @file The learning error of single flights, from which conformal prediction over flights starts.
#pragma once

#include <string>
#include <vector>

#include "analysis/residuals/inputs.h"
#include "analysis/residuals/learning_error.h"

namespace swarmcert::residuals {

/// Of one vehicle in one flight, in newton, axes x, y, z and the vector.
struct FlightError {
  std::string path;  ///< of the log
  std::size_t windows = 0;
  Eigen::Vector4d bias = Eigen::Vector4d::Zero();  ///< |mean|
  ErrorWindow largest{};                           ///< of each number the largest over the windows
};

/// One per vehicle whose force is judged and whose log holds a window at least, in the order of flights. The logs are taken
/// from the cache of `inputs`.
std::vector<FlightError> flight_errors(const Inputs& inputs, int jobs);

}  // namespace swarmcert::residuals
