/// @file The track of one vehicle in a flight, on the flight's clock, with its neighbours and with cuts.
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

/// Why a record is not used. If several reasons apply, the first in this order is stored.
enum class Cut : unsigned char {
  kNone,
  kCrash,       ///< from 0.3 s before the thrust axis is more than 60 degrees from the vertical, to the end
  kNotFlying,   ///< rotors off or idle, outside the thrust calibration; see rule()
  kContact,     ///< at or below the height at which the vehicle stands
  kSettling,    ///< within 0.15 s after the start or a gap in the log, while filters settle
  kNeighbour,   ///< a neighbour's position is unknown: its log has a gap, has not begun or has ended
  kLargeForce,  ///< only with CutRules::published
  kImpact,      ///< around an impossible record, see cut_impacts(): collisions, touch-down, wrapped integers
  kCount
};
const char* name(Cut cut);
/// Describes the rule in words.
const char* rule(Cut cut);

/// Rules for cutting and filtering flights.
struct CutRules {
  /// Follows the networks' authors: neighbours are interpolated regardless of clocks and gaps, contact and settling are
  /// kept, |f_a,z| >= 50 gf is dropped although that depends on the label; thrust lag 0.16 per record, no accelerometer
  /// filter.
  bool published = false;
  /// Uses only the authors' thrust lag, masses and missing accelerometer filter.
  bool published_signals = false;
  /// Does not cut impacts. Set by --published-signals, because the authors' labels keep them.
  bool keep_impacts = false;
  /// The tracks are used for fitting: damaged logs serve only as neighbours.
  bool fits = false;
  /// Uses damaged and implausible logs like any others.
  bool keep = false;

  /// No model is known: the thrust of each log is given in multiples of its hover thrust.
  bool per_mass = false;

  bool has_published_signals() const { return published || published_signals; }
};

/// Properties of a log and how it is used.
struct TrackHead {
  std::string flight, scenario, vehicle, kind, path;
  bool position_only = false;
  logs::ThrustSource thrust_source = logs::ThrustSource::kDuty;
  logs::ForceSource force_source = logs::ForceSource::kAccelerometer;
  /// 1 for the axes of W along which the log allows a force to be judged; 0 for the others, whose residual is zero.
  Eigen::Vector3d judged = Eigen::Vector3d::Ones();
  std::vector<logs::Doubt> doubts;  ///< doubts that refuse the force have made the track position only
  double clock_offset_s = 0;        ///< relative to the clock of the first vehicle
  int clock_onsets = 0;  ///< number of common starts of a trajectory it is based on; 0: not estimated
  bool has_reference_clock = false;  ///< the first log of its flight
  bool has_absolute_clock = false;  ///< the offset is the difference of two absolute clocks, or 0 in one file
};

struct Track : TrackHead {
  bool has_rates = false;
  bool has_rotor_speeds =
      false;               ///< measured: they do not alias the attitude loop as commands of a slow log do
  bool has_height = true;  ///< the log has a position, so ground contact can be detected
  double window_s = 0;     ///< of the derivative, if force_source is not the accelerometer
  logs::TorqueUse torque_use = logs::TorqueUse::kDynamic;
  logs::LogHealth health;
  std::vector<stability::Instant> instants;  ///< thrust_N and mass_kg are set by apply_model()
  std::vector<stability::Neighbour> neighbours;
  std::vector<std::array<double, 4>> duty;
  /// logs::Sample::motor_command of `motor_commands` motors, with their power; empty if there are none.
  std::vector<std::array<float, 8>> motor_command;
  int motor_commands = 0, motor_power = 1;
  std::vector<double> given_thrust;  ///< logs::Sample::given_thrust; empty if thrust_source is kDuty
  std::vector<Eigen::Vector3d> specific_force_m_s2;
  std::vector<stability::Setpoint> targets;  ///< without accelerations; empty if the log has no setpoints
  std::vector<char> restarts;
  std::vector<Cut> cut;
  std::size_t used = 0;  ///< records without a cut

  double duration_s() const {
    return instants.empty() ? 0 : instants.back().time_s - instants.front().time_s;
  }
};

/// Kinds and masses of everything that flies, so that neighbours can be referred to by index.
struct Kinds {
  std::vector<std::string> names;
  std::vector<double> masses_kg;
  int index(const std::string& kind) const;  ///< -1 if unknown
};

/// Reads the logs of a flight, estimates their clock offsets from the starts of commanded motions, and applies the
/// cuts. A log that cannot be read at all is skipped and listed in `problems`.
/// @param fallback_kind kind of vehicles that are not in `fleet`
std::vector<Track> load_flight(const FlightFiles& flight, const Fleet& fleet,
                               const std::string& fallback_kind, const Kinds& kinds,
                               const logs::SignalMap& map, const CutRules& rules, LogCache& cache,
                               std::vector<std::string>& problems);

}  // namespace swarmcert::residuals
