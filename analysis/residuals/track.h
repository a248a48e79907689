/// @file One vehicle's part of a flight, on the flight's clock, among its neighbours, cut to where it flew.
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "analysis/logs/log.h"
#include "analysis/logs/plausibility.h"
#include "analysis/logs/signals.h"
#include "analysis/residuals/flight_set.h"
#include "analysis/residuals/log_cache.h"
#include "stability/effects/effect.h"
#include "stability/tasks/task.h"

namespace swarmcert::residuals {

/// Why a record is not used. The first that applies, in this order.
enum class Cut : unsigned char {
  kNone,
  kCrash,       ///< from 0.3 s before the thrust axis is more than 60 degrees from the vertical, to the end
  kNotFlying,   ///< rotors off or idle, outside the thrust calibration; see rule()
  kContact,     ///< at or below the height where the vehicle stands
  kSettling,    ///< within 0.15 s after the start or after a gap in the log: filters have no past
  kNeighbour,   ///< a neighbour's position is unknown: its log has a gap, has not begun or has ended
  kLargeForce,  ///< only with CutRules::published
  kImpact,  ///< about a record that no flight has, see cut_impacts(): collisions, touch-down, wrapped integers
  kCount
};
const char* name(Cut cut);
/// The rule in words.
const char* rule(Cut cut);

/// How flights are cut and filtered.
struct CutRules {
  /// As the networks' authors did: neighbours interpolated without regard to clocks and gaps, contact and settling
  /// kept, |f_a,z| >= 50 gf dropped although that looks at the label; thrust lag 0.16 per record, no accelerometer
  /// filter.
  bool published = false;
  /// Of these, only their thrust lag, their masses and the missing accelerometer filter.
  bool published_signals = false;
  /// Impacts are not cut. Set with --published-signals: the authors' labels keep them.
  bool keep_impacts = false;
  /// Damaged logs are only neighbours: what is fitted to flights must not rest on them.
  bool fits = false;
  /// Damaged and implausible logs are judged and fitted all the same.
  bool keep = false;

  /// No model is known: the thrust of every log is taken in multiples of its hover thrust.
  bool per_mass = false;

  bool has_published_signals() const { return published || published_signals; }
};

/// What a log is, and how it is used.
struct TrackHead {
  std::string flight, scenario, vehicle, kind, path;
  bool position_only = false;
  logs::ThrustSource thrust_source = logs::ThrustSource::kDuty;
  logs::ForceSource force_source = logs::ForceSource::kAccelerometer;
  /// 1 for the axes of W along which the log lets a force be judged, 0 for the others, whose residual is zero.
  Eigen::Vector3d judged = Eigen::Vector3d::Ones();
  std::vector<logs::Doubt> doubts;   ///< those that refuse a force have made the track position only
  double clock_offset_s = 0;         ///< of this log's clock against the first vehicle's
  int clock_onsets = 0;              ///< how many common starts of a trajectory gave it; 0: not estimated
  bool has_reference_clock = false;  ///< the first log of its flight
  bool has_absolute_clock = false;   ///< the offset is the difference of two absolute clocks
};

struct Track : TrackHead {
  bool has_rates = false;
  bool has_height = true;  ///< the log has a position: contact with the ground can be seen
  double window_s = 0;     ///< of the derivative where force_source is no accelerometer
  logs::TorqueUse torque_use = logs::TorqueUse::kDynamic;
  logs::LogHealth health;
  std::vector<stability::Instant> instants;  ///< thrust_N and mass_kg are set by apply_model()
  std::vector<stability::Neighbour> neighbours;
  std::vector<std::array<double, 4>> duty;
  /// logs::Sample::motor_command of `motor_commands` motors, with their power; empty where that is 0.
  std::vector<std::array<float, 8>> motor_command;
  int motor_commands = 0, motor_power = 1;
  std::vector<double> given_thrust;  ///< logs::Sample::given_thrust; empty where thrust_source is kDuty
  std::vector<Eigen::Vector3d> specific_force_m_s2;
  std::vector<stability::Setpoint> targets;  ///< empty where the log has no set points; no accelerations
  std::vector<char> restarts;
  std::vector<Cut> cut;
  std::size_t used = 0;  ///< records without a cut

  double duration_s() const {
    return instants.empty() ? 0 : instants.back().time_s - instants.front().time_s;
  }
};

/// Kinds and masses of everything that flies, so that neighbours can be named by index.
struct Kinds {
  std::vector<std::string> names;
  std::vector<double> masses_kg;
  int index(const std::string& kind) const;  ///< -1 if unknown
};

/// Reads a flight's logs, estimates the offsets of their clocks from the starts of commanded movements, cuts.
/// A log that cannot be read at all is left out and named in `problems`.
/// @param fallback_kind of vehicles that `fleet` does not name.
std::vector<Track> load_flight(const FlightFiles& flight, const Fleet& fleet,
                               const std::string& fallback_kind, const Kinds& kinds,
                               const logs::SignalMap& map, const CutRules& rules, LogCache& cache,
                               std::vector<std::string>& problems);

}  // namespace swarmcert::residuals
