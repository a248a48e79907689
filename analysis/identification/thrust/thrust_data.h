/// @file Load-cell recordings: thrust of one rotor by PWM and battery voltage.
#pragma once

#include <string>
#include <vector>

namespace swarmcert::analysis {

/// A row in the units of the calibration polynomials.
struct ThrustSample {
  double p = 0;          ///< PWM / 65536, 0 to 1
  double v = 0;          ///< battery voltage / 4.2 V
  double thrust_gf = 0;  ///< of one rotor, in gram-force
  long run = 0;          ///< column `run`, or 0
  int line = 0;          ///< in the file
};

/// The column from which a signal was read, and the unit assumed.
struct SignalSource {
  std::string column, unit;
};

struct ThrustData {
  std::string path;
  std::vector<ThrustSample> samples;  ///< in the file's order
  SignalSource pwm, voltage, thrust;
  bool has_runs = false;
};

/// Reads a table with a header line. Cells are separated by commas, semicolons or tabs. Blank lines, and lines after
/// the header that begin with #, are skipped; a # before the first name of the header is ignored.
///
/// Signals are recognised by name, ignoring case and blanks, with the unit as a suffix or in brackets:
///   pwm     `pwm`, `pwm1` to `pwm4` (their mean is used), `motor_pwm`, `u`   unit counts (0 to 65535, the default),
///           `ratio` (0 to 1; assumed if no value exceeds 1) or `percent`
///   voltage `vbat`, `voltage`, `battery`, `battery_voltage`               unit V (default) or mV
///   thrust  `thrust`, `force`, `load`                                     unit gf (default; g, gram), N or mN
///   run     `run`, `ramp`, `sweep`: optional whole number, the same for all rows of a ramp of the motors
/// Examples: "pwm,vbat,thrust_gf", "# PWM[counts]; battery_voltage(mV); force (N)". Other columns are ignored.
/// @param rotors_together number of rotors that pushed on the load cell together; forces are divided by it
/// @throws files::InputError with line, column, value and hint: a missing, repeated or ambiguous column, a cell that
///   is not a finite number, a missing cell, an impossible PWM, voltage or force, or no rows.
ThrustData load_thrust_data(const std::string& path, int rotors_together);

/// Like load_thrust_data(), from memory; `path` is used only in messages.
ThrustData parse_thrust_data(const std::string& text, const std::string& path, int rotors_together);

}  // namespace swarmcert::analysis
