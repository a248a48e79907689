/// @file Streams in the logs of a flight that belong to other logs: setpoints, paths and sensors.
///
/// A vehicle follows its own setpoints, and its velocity changes as its own accelerometer measures. If the path in a
/// log matches the setpoints of another log, or its sensors match the path of another log, a stream is mislabelled.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "analysis/residuals/track.h"

namespace swarmcert::identification {

/// Misfit between a stream of each log and a stream of each log of the same flight.
struct Misfits {
  int logs = 0;
  /// [own * logs + other]: maps a block of 1 s on the flight's clock to the mean square in it.
  std::vector<std::map<int, double>> squares;

  const std::map<int, double>& of(int own, int other) const {
    return squares[static_cast<std::size_t>(own * logs + other)];
  }
};

/// Returns the distance of the path of `own` from the setpoints of `other`, m. Empty if logs have no setpoints.
Misfits set_point_misfits(const std::vector<residuals::Track>& tracks);

/// Returns the mean acceleration over half a second from the path of `other` minus that measured by the accelerometer
/// of `own`, m/s^2, after subtracting the mean over the flight, so that scale and tilt errors are not counted as
/// misfit. Empty if logs have no accelerometer.
Misfits sensor_misfits(const std::vector<residuals::Track>& tracks);

/// Returns the log to which each log belongs. This is the log itself unless another one fits twice as well (root mean
/// square) according to a test on the logarithms of blocks, at 1 % for all `tried` pairs of all flights together, and
/// these logs exchange their streams in a cycle, which a chance match would not close.
std::vector<int> belongs_to(const Misfits& misfits, int tried);

/// Returns the root mean square over the blocks that both pairs have; 0 if there are none.
double root_mean_square(const Misfits& misfits, int own, int other);

}  // namespace swarmcert::identification
