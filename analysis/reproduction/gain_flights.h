/// @file Flights with known gains from other groups: folders with logs/logNN[_k] and info/infoNN.yaml.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "analysis/reproduction/setting.h"

namespace swarmcert::reproduction {

/// Contents of infoNN.yaml: `key: value`, one per line, Kpos_Px .. Kpos_Iz, KR_x .. KI_z, mass, motors.
struct FlownGains {
  std::array<double, 3> Kp{}, Kd{}, Ki{};  ///< per world axis; 1/s^2, 1/s, 1/s^3
  std::array<double, 3> KR{}, Kw{}, KI{};  ///< gains of Lee's attitude law, per body axis; N m, N m s, N m/s
  double mass_kg = 0;                      ///< mass used by the control law
  std::string motors;                      ///< empty if the file does not state them
};

/// @throws files::InputError with line, key, value and hint if a key is missing or its value is not a number in range.
FlownGains read_flown_gains(const std::string& path);

/// Time step of FlownAxis::set_point_m_s.
inline constexpr double kSetPointStep_s = 0.008;

/// One world axis in one flight.
struct FlownAxis {
  double peak_m = 0, rms_m = 0;       ///< of the estimated position minus the setpoint
  double range_m = 0, speed_m_s = 0;  ///< of the setpoint
  std::vector<double> set_point_m_s;  ///< velocity of the setpoint; empty if it is constant
  bool moves() const { return !set_point_m_s.empty(); }
};

struct GainFlight {
  std::string log;     ///< name of the log
  std::string sha256;  ///< of the log
  FlownGains gains;
  std::array<FlownAxis, 3> axes;
  double thrust_ratio = 0;  ///< weight over mean commanded thrust
};

struct GainFolder {
  std::string path;
  std::vector<GainFlight> flights;                            ///< by name
  std::vector<std::pair<std::string, std::string>> left_out;  ///< name, why
  std::vector<std::string> inputs;
};

/// Reads all logs. A flight is left out and reported if its log cannot be read or has no position, setpoint or thrust
/// in newtons, if it has no info file, or if it begins or ends on the ground, where the position loop is open. Records
/// before a pause near the start of a log are dropped.
/// @throws files::InputError if the folders are missing or contain no flight, or as read_flown_gains().
GainFolder read_gain_folder(const std::string& path, const Setting& setting);

}  // namespace swarmcert::reproduction
