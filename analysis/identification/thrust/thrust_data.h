/// @file Load-cell recordings: what one rotor pushes at which PWM and battery voltage.
#pragma once

#include <string>
#include <vector>

namespace swarmcert::analysis {

/// One row, in the units of the calibration polynomials.
struct ThrustSample {
  double p = 0;          ///< PWM / 65536, 0 to 1
  double v = 0;          ///< battery voltage / 4.2 V
  double thrust_gf = 0;  ///< of one rotor, in gram-force
  long run = 0;          ///< the column `run`, else 0
  int line = 0;          ///< in the file
};

/// Which column a signal was read from, and the unit it was taken in.
struct SignalSource {
  std::string column, unit;
};

struct ThrustData {
  std::string path;
  std::vector<ThrustSample> samples;  ///< in the file's order
  SignalSource pwm, voltage, thrust;
  bool has_runs = false;
};

/// Reads a table with a header line: cells separated by commas, semicolons or tabs; lines that begin with # after the
/// header, and blank lines, are skipped; a # before the header's first name is.
///
/// Signals are recognised by name, capitals and blanks aside, with the unit as suffix or in brackets:
///   pwm     `pwm`, `pwm1` to `pwm4` (their mean is taken), `motor_pwm`, `u`  unit counts (0 to 65535, the default),
///           `ratio` (0 to 1; assumed where no value exceeds 1) or `percent`
///   voltage `vbat`, `voltage`, `battery`, `battery_voltage`               unit V (default) or mV
///   thrust  `thrust`, `force`, `load`                                     unit gf (default; g, gram), N or mN
///   run     `run`, `ramp`, `sweep`: optional whole number; rows of one ramp of the motors carry the same
/// Examples: "pwm,vbat,thrust_gf", "# PWM[counts]; battery_voltage(mV); force (N)". Other columns are not read.
/// @param rotors_together how many rotors pushed on the load cell: the forces are divided by it.
/// @throws files::InputError with line, column, value and hint: a missing, repeated or ambiguous column, a cell that
///   is not a finite number, a missing cell, a PWM, voltage or force that cannot be, no rows.
ThrustData load_thrust_data(const std::string& path, int rotors_together);

/// As load_thrust_data(), from memory; `path` is used in messages only.
ThrustData parse_thrust_data(const std::string& text, const std::string& path, int rotors_together);

}  // namespace swarmcert::analysis
