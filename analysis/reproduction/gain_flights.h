/// @file Flights of other people's gains: folders with logs/logNN[_k] and info/infoNN.yaml.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "analysis/reproduction/setting.h"

namespace swarmcert::reproduction {

/// What infoNN.yaml says: `key: value`, one per line, Kpos_Px .. Kpos_Iz, KR_x .. KI_z, mass, motors.
struct FlownGains {
  std::array<double, 3> Kp{}, Kd{}, Ki{};  ///< per world axis; 1/s^2, 1/s, 1/s^3
  std::array<double, 3> KR{}, Kw{}, KI{};  ///< of Lee's attitude law, per body axis; N m, N m s, N m/s
  double mass_kg = 0;                      ///< as the law was told
  std::string motors;                      ///< empty where the file does not say
};

/// @throws files::InputError naming the line, key, value and a hint, if a key is missing or its value is no number in
/// range.
FlownGains read_flown_gains(const std::string& path);

/// Interval between the moments of FlownAxis::set_point_m_s.
inline constexpr double kSetPointStep_s = 0.008;

/// One axis of the world in one flight.
struct FlownAxis {
  double peak_m = 0, rms_m = 0;       ///< of the estimated position less the set point
  double range_m = 0, speed_m_s = 0;  ///< of the set point
  std::vector<double> set_point_m_s;  ///< its velocity; empty where it stays
  bool moves() const { return !set_point_m_s.empty(); }
};

struct GainFlight {
  std::string log;     ///< its name
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

/// Reads all logs. A flight is left out, and named, where its log cannot be read or has no position, set point or
/// thrust in newtons, where no info file belongs to it, or where it begins or ends on the ground: there the position
/// loop is open. The first records of a log before a pause are dropped.
/// @throws files::InputError where the folders are missing or hold no flight, or as read_flown_gains().
GainFolder read_gain_folder(const std::string& path, const Setting& setting);

}  // namespace swarmcert::reproduction
