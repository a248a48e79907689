/// @file The learning error of single flights, from which conformal prediction over flights starts.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "analysis/residuals/inputs.h"
#include "analysis/residuals/place_residual.h"
#include "analysis/residuals/velocity_error.h"

namespace swarmcert::residuals {

/// Of one error of one vehicle in one flight, axes x, y, z and the vector.
struct ErrorOfFlight {
  std::vector<ErrorWindow> windows;
  Eigen::Vector4d bias = Eigen::Vector4d::Zero();  ///< |mean|

  /// Of each number the largest over the windows; there is one at least.
  ErrorWindow largest() const;
};

struct FlightError {
  std::string path;        ///< of the log
  ErrorOfFlight force;     ///< in newton
  ErrorOfFlight velocity;  ///< velocity_error(), in m/s; no windows where the log does not measure it
  std::vector<PlaceResidual> places;  ///< range of the force residual by place of the neighbour
};

/// Of a track as Inputs::load() gives it; nothing where its force is not judged, or its log holds no window. The log is
/// taken from the cache of `inputs`.
std::optional<FlightError> flight_error(const Inputs& inputs, const Track& track);

/// flight_error() of all tracks, in the order of flights.
std::vector<FlightError> flight_errors(const Inputs& inputs, int jobs);

/// The velocity's error over all windows of all flights; nothing where no log measures it.
std::optional<VelocityError> velocity_error(const std::vector<FlightError>& errors);

}  // namespace swarmcert::residuals
