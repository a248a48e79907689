/// @file Signal path from command to force, and from truth to log.
#pragma once

namespace swarmcert::stability {

/// Each stage takes the signal u of the previous stage and outputs u + gain (stage(u) - u): gain 1 is the stage itself,
/// and the difference from u is `gain` times the effect's column.
/// Order: command -> delay -> motor lag -> rotors; true specific force -> sensor delay -> accelerometer filter.
struct SignalPath {
  double delay_s = 0, delay_gain = 0;
  double motor_lag_s = 0, motor_lag_gain = 0;
  double sensor_delay_s = 0, sensor_delay_gain = 0;
};

}  // namespace swarmcert::stability
