/// @file Streams of the logs of one flight that belong to other logs: set points, paths and sensors.
///
/// A vehicle follows its own set points, and gains the velocity that its own accelerometer feels. Where the path in a
/// log fits the set points of another log, or its sensors fit the path of another log, a stream has been mislabelled.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "analysis/residuals/track.h"

namespace swarmcert::identification {

/// How badly a stream of each log fits a stream of each log of the same flight.
struct Misfits {
  int logs = 0;
  /// [own * logs + other], in order: from the block of 1 s of the flight's clock to the mean square in it.
  std::vector<std::map<int, double>> squares;

  const std::map<int, double>& of(int own, int other) const {
    return squares[static_cast<std::size_t>(own * logs + other)];
  }
};

/// Distance of the path of `own` to the set points of `other`, m. Empty where logs have no set points.
Misfits set_point_misfits(const std::vector<residuals::Track>& tracks);

/// The mean acceleration over half a second that the path of `other` shows, minus that which the accelerometer of `own`
/// feels, about the mean of the flight, m/s^2: an error of scale or tilt is no misfit. Empty where logs have no
/// accelerometer.
Misfits sensor_misfits(const std::vector<residuals::Track>& tracks);

/// Which log each one belongs to: itself, unless another one fits twice as well (root mean square), by a test over the
/// logarithms of blocks at 1 % for all `tried` pairs of all flights together, and these logs exchange their streams
/// around a circle: one that fits another one by chance does not close it.
std::vector<int> belongs_to(const Misfits& misfits, int tried);

/// Root of the mean over the blocks that both pairs have; 0 where they have none.
double root_mean_square(const Misfits& misfits, int own, int other);

}  // namespace swarmcert::identification
