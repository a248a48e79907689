/// @file Learning errors of single flights, the input of conformal prediction over flights.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "analysis/residuals/inputs.h"
#include "analysis/residuals/place_residual.h"
#include "analysis/residuals/velocity_error.h"

namespace swarmcert::residuals {

/// One error of one vehicle in one flight, for the axes x, y, z and the vector.
struct ErrorOfFlight {
  std::vector<ErrorWindow> windows;
  Eigen::Vector4d bias = Eigen::Vector4d::Zero();  ///< |mean|

  /// Returns the largest value of each number over the windows. Precondition: there is at least one window.
  ErrorWindow largest() const;
};

struct FlightError {
  std::string path;                   ///< of the log
  ErrorOfFlight force;                ///< in newton
  ErrorOfFlight velocity;             ///< velocity_error() in m/s; no windows if the log does not measure it
  std::vector<PlaceResidual> places;  ///< range of the force residual by relative position of the neighbour
};

/// Returns the error of a track loaded by Inputs::load(); nothing if its force is not judged or its log contains no
/// window. The log is taken from the cache of `inputs`.
std::optional<FlightError> flight_error(const Inputs& inputs, const Track& track);

/// Returns flight_error() of all tracks, in the order of flights.
std::vector<FlightError> flight_errors(const Inputs& inputs, int jobs);

/// Returns the velocity error over all windows of all flights; nothing if no log measures it.
std::optional<VelocityError> velocity_error(const std::vector<FlightError>& errors);

}  // namespace swarmcert::residuals
