#include "analysis/residuals/track.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "analysis/logs/flight_story.h"
#include "analysis/logs/read_log.h"
#include "analysis/logs/vehicles_in_file.h"
#include "analysis/residuals/published_vehicle.h"
#include "analysis/residuals/smoothing_window.h"
#include "nn/base/input_error.h"
#include "nn/base/median.h"

namespace swarmcert::residuals {
namespace {

constexpr double kCrashTiltCosine = 0.5;  // 60 degrees
constexpr double kBeforeCrash_s = 0.3;
constexpr double kLeastDuty = 0.8, kLeastDutyShare = 0.3;  // of the maximum in a log
constexpr double kSettle_s = 0.15;
constexpr double kLeastShare = 0.3;  // of the typical thrust in a log
constexpr double kAboveStanding_m = 0.02, kUsualWithin_m = 0.03;
constexpr double kClear_m = 0.01;  // above the ground, wherever the vehicle stands

/// Returns the standing height of the published vehicles; NaN for others, whose logs must show it.
double contact_height_m(const std::string& kind) {
  const PublishedVehicle* const published = published_vehicle(kind);
  return published != nullptr ? published->standing_height_m : std::numeric_limits<double>::quiet_NaN();
}

Eigen::Vector3d vector(const logs::Vector& v) { return {v[0], v[1], v[2]}; }

/// Returns the times at which the target starts to move after a pause, in seconds on the log's clock.
std::vector<double> onsets_s(const logs::Log& log) {
  constexpr double kStill_s = 0.3;
  constexpr double kStill_m_s = 1e-6;
  std::vector<double> onsets;
  if (!log.signals.targets) return onsets;
  double still_since_us = -1;
  for (const logs::Sample& s : log.samples) {
    const double speed = vector(s.target_velocity_m_s).norm();
    if (s.restarts) still_since_us = -1;
    if (speed <= kStill_m_s) {
      if (still_since_us < 0) still_since_us = s.time_us;
      continue;
    }
    if (still_since_us >= 0 && s.time_us - still_since_us > 1e6 * kStill_s)
      onsets.push_back(1e-6 * s.time_us);
    still_since_us = -1;
  }
  return onsets;
}

/// Returns the median difference between matching onsets; 0 if none match.
double clock_offset_s(const std::vector<double>& reference, const std::vector<double>& own, int* matched) {
  constexpr double kLargestOffset_s = 0.1;
  std::vector<double> differences;
  for (const double onset : own) {
    for (const double other : reference) {
      if (std::abs(onset - other) < kLargestOffset_s) differences.push_back(onset - other);
    }
  }
  *matched = static_cast<int>(differences.size());
  return upper_median(std::move(differences));
}

struct State {
  Eigen::Vector3d p, v;
};

/// Returns the state of `log` at `time_s` on its clock, interpolated; nothing across a gap or outside the log.
/// @param from where the search starts; times must ascend from call to call
std::optional<State> state_at(const logs::Log& log, double time_s, bool everywhere, std::size_t& from) {
  const std::vector<logs::Sample>& samples = log.samples;
  if (samples.empty()) return std::nullopt;
  const double time_us = 1e6 * time_s;
  while (from + 1 < samples.size() && samples[from + 1].time_us <= time_us) ++from;
  const logs::Sample& a = samples[from];
  const bool last = from + 1 == samples.size();
  if (time_us < a.time_us || last) {
    const double away_us = std::abs(time_us - a.time_us);
    if (!everywhere && away_us > 1e6 * logs::kLongestGap_s) return std::nullopt;
    return State{vector(a.position_m), vector(a.velocity_m_s)};
  }
  const logs::Sample& b = samples[from + 1];
  if (b.restarts && !everywhere && time_us != a.time_us) return std::nullopt;
  const double share = (time_us - a.time_us) / (b.time_us - a.time_us);
  return State{vector(a.position_m) + share * (vector(b.position_m) - vector(a.position_m)),
               vector(a.velocity_m_s) + share * (vector(b.velocity_m_s) - vector(a.velocity_m_s))};
}

void fill_instants(Track& track, const logs::Log& log) {
  const std::size_t n = log.samples.size();
  track.instants.resize(n);
  track.duty.resize(n);
  track.specific_force_m_s2.resize(n);
  track.restarts.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const logs::Sample& s = log.samples[i];
    stability::Instant& now = track.instants[i];
    now.time_s = 1e-6 * s.time_us - track.clock_offset_s;
    now.p_W_m = vector(s.position_m);
    now.v_W_m_s = vector(s.velocity_m_s);
    const auto R = s.attitude.rotation();
    for (int row = 0; row < 3; ++row)
      now.R_WB.row(row) = vector(R[static_cast<std::size_t>(row)]).transpose();
    if (log.signals.rates) now.omega_B_rad_s = vector(s.rates_rad_s);
    now.battery_V = s.battery_V > 0 ? s.battery_V : stability::kFullBattery_V;
    track.duty[i] = s.duty;
    track.specific_force_m_s2[i] = vector(s.specific_force_m_s2);
    track.restarts[i] = s.restarts ? 1 : 0;
    if (track.thrust_source != logs::ThrustSource::kDuty) track.given_thrust.push_back(s.given_thrust);
    if (track.motor_commands > 0) track.motor_command.push_back(s.motor_command);
    if (log.signals.targets)
      track.targets.push_back(
          {vector(s.target_position_m), vector(s.target_velocity_m_s), Eigen::Vector3d::Zero()});
  }
}

/// Derives the specific force of logs without an accelerometer, over the window also applied to the model's force.
void derive_specific_force(Track& track) {
  if (track.force_source == logs::ForceSource::kAccelerometer || track.judged.isZero()) return;
  SmoothingWindow window(track.force_source, track.window_s, 1);
  const bool is_velocity = track.force_source == logs::ForceSource::kVelocity;
  for (std::size_t i = 0; i < track.instants.size(); ++i) {
    const stability::Instant& now = track.instants[i];
    if (track.restarts[i] != 0) window.restart();
    Eigen::Matrix3Xd value = is_velocity ? now.v_W_m_s : now.p_W_m;
    window.differentiate(now.time_s, value);
    track.specific_force_m_s2[i] = value.col(0) + logs::kGravity_m_s2 * Eigen::Vector3d::UnitZ();
  }
}

/// Returns true if the vehicle was at positions at least half a metre apart.
bool has_moved(const Track& track) {
  constexpr double kMoved_m = 0.5;
  Eigen::Vector3d low = Eigen::Vector3d::Constant(INFINITY), high = -low;
  for (const stability::Instant& now : track.instants) {
    low = low.cwiseMin(now.p_W_m);
    high = high.cwiseMax(now.p_W_m);
  }
  return !track.instants.empty() && (high - low).maxCoeff() > kMoved_m;
}

/// Returns, for each record, whether the rotors carry next to nothing.
std::vector<char> rotors_idle(const Track& track) {
  std::vector<char> idle(track.instants.size(), 0);
  const bool by_duty = track.thrust_source == logs::ThrustSource::kDuty;
  std::vector<double> thrust = track.given_thrust;
  if (by_duty) {
    for (const auto& d : track.duty) thrust.push_back(d[0] + d[1] + d[2] + d[3]);
  }
  if (thrust.empty()) return idle;
  std::vector<double> sorted = thrust;
  const auto at = [&sorted](std::size_t hundredths) {
    const auto place = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() * hundredths / 100);
    std::nth_element(sorted.begin(), place, sorted.end());
    return *place;
  };
  double least = kLeastShare * at(75);
  // Strong rotors need less duty to carry the vehicle; this is assumed only of a vehicle that moved.
  if (by_duty) least = has_moved(track) ? std::min(kLeastDuty, kLeastDutyShare * at(98)) : kLeastDuty;
  for (std::size_t i = 0; i < idle.size(); ++i) idle[i] = thrust[i] < least ? 1 : 0;
  return idle;
}

std::vector<double> standing_height_m(const Track& track, const std::vector<char>& idle) {
  std::vector<double> time_s, height_m, speed_m_s;
  for (const stability::Instant& now : track.instants) {
    time_s.push_back(now.time_s);
    height_m.push_back(now.p_W_m.z());
    speed_m_s.push_back(now.v_W_m_s.norm());
  }
  return logs::standing_heights_m(time_s, height_m, speed_m_s, idle);
}

void cut_phases(Track& track, const CutRules& rules) {
  const std::size_t n = track.instants.size();
  const std::vector<char> idle = rotors_idle(track);
  const std::vector<double> standing_m = standing_height_m(track, idle);
  const bool derived = track.force_source != logs::ForceSource::kAccelerometer;
  track.cut.assign(n, Cut::kNone);
  double crash_s = INFINITY;
  for (std::size_t i = 0; i < n && std::isinf(crash_s); ++i) {
    if (track.judged.x() > 0 && track.instants[i].R_WB(2, 2) < kCrashTiltCosine)
      crash_s = track.instants[i].time_s - kBeforeCrash_s;
  }
  double settled_s = -INFINITY;
  for (std::size_t i = 0; i < n; ++i) {
    const stability::Instant& now = track.instants[i];
    if (track.restarts[i] != 0)
      settled_s = now.time_s + (derived ? std::max(kSettle_s, 1.5 * track.window_s) : kSettle_s);
    // The height at which the vehicle stood is used unless it agrees with the usual one within a few centimetres.
    const double usual_m = contact_height_m(track.kind), stood_m = standing_m[i] + kAboveStanding_m;
    const bool is_usual = std::isfinite(usual_m) && !(std::abs(stood_m - usual_m) > kUsualWithin_m);
    const double contact_m = is_usual ? std::max(usual_m, standing_m[i] + kClear_m) : stood_m;
    Cut& cut = track.cut[i];
    if (now.time_s >= crash_s)
      cut = Cut::kCrash;
    else if (idle[i] != 0)
      cut = Cut::kNotFlying;
    else if (!rules.published && track.has_height && now.p_W_m.z() <= contact_m)
      cut = Cut::kContact;
    else if (!rules.published && now.time_s < settled_s)
      cut = Cut::kSettling;
    // The window of a derivative must not include the ground.
    if (derived && (cut == Cut::kNotFlying || cut == Cut::kContact))
      settled_s = std::max(settled_s, now.time_s + track.window_s);
  }
}

struct LoadedLog {
  std::shared_ptr<const CachedLog> cached;
  std::size_t track;
};

void add_neighbours(Track& track, std::size_t own, const std::vector<LoadedLog>& all,
                    const std::vector<Track>& tracks, const Kinds& kinds, const CutRules& rules) {
  const std::size_t others = all.size() - 1;
  track.neighbours.resize(track.instants.size() * others);
  std::vector<std::size_t> from(all.size(), 0);
  for (std::size_t i = 0; i < track.instants.size(); ++i) {
    stability::Instant& now = track.instants[i];
    now.neighbours = track.neighbours.data() + i * others;
    std::size_t count = 0;
    for (std::size_t j = 0; j < all.size(); ++j) {
      if (j == own) continue;
      const Track& other = tracks[all[j].track];
      const double time_s = now.time_s + (rules.published ? 0 : other.clock_offset_s);
      const std::optional<State> state = state_at(all[j].cached->log, time_s, rules.published, from[j]);
      if (!state) {
        if (track.cut[i] == Cut::kNone) track.cut[i] = Cut::kNeighbour;
        continue;
      }
      const int kind = kinds.index(other.kind);
      track.neighbours[i * others + count++] = {state->p - now.p_W_m, state->v - now.v_W_m_s, state->v,
                                                kinds.masses_kg[static_cast<std::size_t>(kind)], kind};
    }
    now.num_neighbours = static_cast<int>(count);
  }
}

}  // namespace

const char* name(Cut cut) {
  static const char* const kNames[] = {"used",     "crash",     "not flying",  "ground contact",
                                       "settling", "neighbour", "large force", "impact"};
  return kNames[static_cast<int>(cut)];
}

const char* rule(Cut cut) {
  static const char* const kRules[] = {
      "everything else",
      "from 0.3 s before the thrust axis is more than 60 degrees from the vertical, to the end of the log",
      "the duties add up to less than 0.8, or to less than 0.3 of their maximum if that is smaller and the "
      "vehicle moved; other thrust is less than 0.3 of its typical value: rotors off or idle, outside the "
      "calibration",
      "at or below 2 cm above the height at which the vehicle stood with idle rotors (kind small: 0.07 m, "
      "large: 0.085 m)",
      "within 0.15 s after the start and after a gap of more than 30 ms: filters are settling",
      "the position of a neighbour is unknown: its log has a gap, has not begun or has ended",
      "published filter only: |f_a,z| of 50 gf or more",
      "from 0.1 s before to 0.3 s after an impossible record: a specific force beyond 1.25 times what the "
      "rotors give at full duty (at least 2 g), or a jump of position or velocity"};
  return kRules[static_cast<int>(cut)];
}

int Kinds::index(const std::string& kind) const {
  const auto found = std::find(names.begin(), names.end(), kind);
  return found == names.end() ? -1 : static_cast<int>(found - names.begin());
}

namespace {

/// Returns true if two logs have the same times and positions: no two vehicles do.
bool have_same_records(const logs::Log& a, const logs::Log& b) {
  return a.signals.position && b.signals.position && !a.samples.empty() &&
         std::equal(a.samples.begin(), a.samples.end(), b.samples.begin(), b.samples.end(),
                    [](const logs::Sample& one, const logs::Sample& other) {
                      return one.time_us == other.time_us && one.position_m == other.position_m;
                    });
}

}  // namespace

std::vector<Track> load_flight(const FlightFiles& flight, const Fleet& fleet,
                               const std::string& fallback_kind, const Kinds& kinds,
                               const logs::SignalMap& map, const CutRules& rules, LogCache& cache,
                               std::vector<std::string>& problems) {
  std::vector<Track> tracks;
  std::vector<LoadedLog> all;
  std::vector<std::vector<double>> onsets;
  for (const auto& [vehicle, path] : flight.logs) {
    std::shared_ptr<const CachedLog> read;
    try {
      read = cache.log(path, map);
    } catch (const files::InputError& error) {
      problems.emplace_back(error.what());
      continue;
    }
    const logs::Log& log = read->log;
    const auto original = std::find_if(all.begin(), all.end(), [&](const LoadedLog& other) {
      return have_same_records(other.cached->log, log);
    });
    if (original != all.end()) {
      problems.push_back(path + ": left out: a copy of " + tracks[original->track].path);
      continue;
    }
    Track track;
    track.flight = flight.name;
    track.scenario = flight.scenario;
    track.vehicle = vehicle;
    track.path = path;
    const auto known = fleet.find(vehicle);
    track.kind = known == fleet.end() ? fallback_kind : known->second.kind;
    const bool only_neighbour =
        (known != fleet.end() && known->second.position_only) || flight.position_only.count(path) != 0;
    const bool has_torque_only =
        !log.signals.force && log.signals.torque != logs::TorqueUse::kNone && !rules.fits;
    track.position_only = (!log.signals.force && !has_torque_only) || only_neighbour;
    if (log.armed == logs::Armed::kNever)
      problems.push_back(path + ": no flight: never armed");
    else if (has_torque_only && !only_neighbour)
      problems.push_back(path + ": only torques, at any speed: for a force the log lacks " +
                         log.signals.force_lacks);
    else if (!log.signals.force && !only_neighbour)
      problems.push_back(path + ": used only as a neighbour: the log lacks " + log.signals.force_lacks);
    track.doubts = read->doubts;
    for (const logs::Doubt& doubt : track.doubts) {
      if (!doubt.refuses_force || track.position_only || rules.keep) continue;
      track.position_only = true;
      problems.push_back(path + ": " + doubt.words);
    }
    if (rules.fits && !rules.keep && !track.position_only && !logs::is_sound(log.health)) {
      track.position_only = true;
      problems.push_back(fmt::format("{}: {}; damaged, left out of the fit (--keep takes it)", path,
                                     fmt::join(logs::findings(log.health), "; ")));
    }
    track.has_rates = log.signals.rates;
    track.has_rotor_speeds = log.signals.rotor_speeds;
    track.has_height = log.signals.position;
    track.thrust_source = log.signals.thrust;
    track.motor_commands = log.signals.motor_commands;
    track.motor_power = log.motor_power;
    track.force_source = log.signals.specific_force;
    track.window_s = log.window_s;
    track.torque_use = log.signals.torque;
    for (int axis = 0; axis < 3; ++axis)
      track.judged[axis] = log.signals.force_axes[static_cast<std::size_t>(axis)] ? 1 : 0;
    track.health = log.health;
    onsets.push_back(onsets_s(log));
    track.has_reference_clock = all.empty();
    const bool is_of_one_file =
        !all.empty() && logs::address_of(path).file == logs::address_of(tracks.front().path).file;
    track.has_absolute_clock = !rules.published && !all.empty() &&
                               (is_of_one_file || (log.epoch_s > 0 && all.front().cached->log.epoch_s > 0));
    if (track.has_absolute_clock)
      track.clock_offset_s = all.front().cached->log.epoch_s - log.epoch_s;
    else if (flight.clock_offsets_s.count(path) == 1)
      track.clock_offset_s = flight.clock_offsets_s.at(path);
    else if (!rules.published && !all.empty())
      track.clock_offset_s = clock_offset_s(onsets[0], onsets.back(), &track.clock_onsets);
    const bool is_clock_known = track.has_reference_clock || track.has_absolute_clock ||
                                track.clock_onsets > 0 || flight.clock_offsets_s.count(path) == 1;
    if (rules.fits && !rules.published && !is_clock_known) {
      problems.push_back(
          path +
          ": its clock could not be related to that of the first log of its flight and is taken to be equal: "
          "no commanded movement starts within 0.1 s of one there; effects of neighbours are judged with it");
    }
    tracks.push_back(std::move(track));
    all.push_back({std::move(read), tracks.size() - 1});
  }
  for (std::size_t k = 0; k < all.size(); ++k) {
    Track& track = tracks[k];
    if (track.position_only) continue;
    fill_instants(track, all[k].cached->log);
    derive_specific_force(track);
    cut_phases(track, rules);
  }
  for (std::size_t k = 0; k < all.size(); ++k) {
    Track& track = tracks[k];
    if (track.position_only) continue;
    add_neighbours(track, k, all, tracks, kinds, rules);
    track.used = static_cast<std::size_t>(std::count(track.cut.begin(), track.cut.end(), Cut::kNone));
  }
  return tracks;
}

}  // namespace swarmcert::residuals
