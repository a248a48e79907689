#include "analysis/residuals/flown_signals.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "analysis/residuals/residual_under.h"
#include "nn/base/pi.h"

namespace swarmcert::residuals {
namespace {

constexpr std::size_t kMostLogs = 24;
constexpr std::size_t kMostRows = 24000;  // of all logs: about 2 MB
constexpr double kAroundMoment_s = 2;
constexpr float kNoValue = std::numeric_limits<float>::quiet_NaN();

/// First columns of the groups.
enum FlownColumn : std::size_t {
  kFlownPosition = 1,
  kFlownSetPoint = 4,
  kFlownVelocity = 7,
  kFlownVelocitySetPoint = 10,
  kFlownAttitude = 13,
  kFlownRates = 16,
  kFlownThrust = 19,
  kFlownMotors = 20,
  kFlownBattery = kFlownMotors + kMostMotors,
  kFlownResidual = kFlownBattery + 1,
  kFlownResidualFitted = kFlownResidual + 3
};

/// Returns indices of flights without repetition: those with the worst moments first, as many as fit.
std::vector<std::size_t> flights_that_fit(const Inputs& inputs, const std::vector<Moment>& worst) {
  const std::vector<FlightFiles>& flights = inputs.found.flights;
  std::vector<std::size_t> chosen;
  std::size_t logs = 0;
  const auto choose = [&](std::size_t i) {
    if (std::find(chosen.begin(), chosen.end(), i) != chosen.end()) return;
    if (!chosen.empty() && logs + flights[i].logs.size() > kMostLogs) return;
    logs += flights[i].logs.size();
    chosen.push_back(i);
  };
  for (const Moment& moment : worst) {
    for (std::size_t i = 0; i < flights.size(); ++i)
      if (flights[i].name == moment.flight) choose(i);
  }
  for (std::size_t i = 0; i < flights.size(); ++i) choose(i);
  return chosen;
}

void set_vector(const Eigen::Vector3d& values, std::size_t first, FlownRow& row) {
  for (std::size_t axis = 0; axis < 3; ++axis)
    row[first + axis] = static_cast<float>(values[static_cast<Eigen::Index>(axis)]);
}

/// The normalised commands, or the duties of the Crazyflie.
void set_motors(const Track& track, std::size_t i, FlownRow& row) {
  float* const motors = &row[kFlownMotors];
  if (track.motor_commands > 0)
    std::copy_n(track.motor_command[i].begin(), track.motor_commands, motors);
  else if (track.thrust_source == logs::ThrustSource::kDuty)
    std::transform(track.duty[i].begin(), track.duty[i].end(), motors,
                   [](double duty) { return static_cast<float>(duty); });
}

Eigen::Vector3d degrees_of(const Eigen::Matrix3d& R) {
  return 180 / kPi *
         Eigen::Vector3d(std::atan2(R(2, 1), R(2, 2)), -std::asin(std::clamp(R(2, 0), -1.0, 1.0)),
                         std::atan2(R(1, 0), R(0, 0)));
}

FlownRow row_of(const Track& track, std::size_t i, bool has_force) {
  const stability::Instant& now = track.instants[i];
  FlownRow row;
  row.fill(kNoValue);
  row[0] = static_cast<float>(now.time_s);
  if (track.has_height) set_vector(now.p_W_m, kFlownPosition, row);
  if (track.targets.size() == track.instants.size()) {
    set_vector(track.targets[i].p_W_m, kFlownSetPoint, row);
    set_vector(track.targets[i].v_W_m_s, kFlownVelocitySetPoint, row);
  }
  set_vector(now.v_W_m_s, kFlownVelocity, row);
  set_vector(degrees_of(now.R_WB), kFlownAttitude, row);
  if (track.has_rates) set_vector(now.omega_B_rad_s, kFlownRates, row);
  if (has_force) row[kFlownThrust] = static_cast<float>(now.thrust_N);
  set_motors(track, i, row);
  row[kFlownBattery] = static_cast<float>(now.battery_V);
  return row;
}

FlownVehicle flown_vehicle(const Track& track, const Inputs& inputs, const Inputs* fitted) {
  FlownVehicle vehicle;
  vehicle.name = track.vehicle;
  vehicle.records = track.instants.size();
  std::vector<Eigen::Vector3d> residual, residual_fitted;
  if (!track.position_only) {
    residual = residual_under(inputs.model_for(track), inputs, track);
    if (fitted != nullptr) residual_fitted = residual_under(fitted->model_for(track), *fitted, track);
  }
  FlownRow gap;
  gap.fill(kNoValue);
  for (std::size_t i = 0; i < track.instants.size(); ++i) {
    if (i > 0 && track.restarts[i] != 0) {
      gap[0] = static_cast<float>((track.instants[i - 1].time_s + track.instants[i].time_s) / 2);
      vehicle.rows.push_back(gap);
    }
    vehicle.rows.push_back(row_of(track, i, !track.position_only));
    if (track.cut[i] != Cut::kNone) continue;
    if (!residual.empty()) set_vector(residual[i], kFlownResidual, vehicle.rows.back());
    if (!residual_fitted.empty()) set_vector(residual_fitted[i], kFlownResidualFitted, vehicle.rows.back());
  }
  return vehicle;
}

/// Returns the least and the largest value of each signal over rows [begin, end), in the order in which they occur.
/// Positions stay those of single rows: the extremes of their axes are not places where the vehicle was.
std::array<FlownRow, 2> extremes_of(const std::vector<FlownRow>& rows, std::size_t begin, std::size_t end) {
  std::array<FlownRow, 2> pair = {rows[begin], rows[(begin + end) / 2]};
  for (std::size_t column = kFlownSetPoint; column < kFlownColumns; ++column) {
    std::size_t least = end, most = end;
    for (std::size_t i = begin; i < end; ++i) {
      if (std::isnan(rows[i][column])) continue;
      if (least == end || rows[i][column] < rows[least][column]) least = i;
      if (most == end || rows[i][column] > rows[most][column]) most = i;
    }
    pair[0][column] = least == end ? kNoValue : rows[std::min(least, most)][column];
    pair[1][column] = least == end ? kNoValue : rows[std::max(least, most)][column];
  }
  return pair;
}

std::vector<FlownRow> thinned(const std::vector<FlownRow>& rows, std::size_t most,
                              const std::vector<double>& moments_s) {
  if (rows.size() <= most) return rows;
  const auto is_kept = [&](const FlownRow& row) {
    return std::any_of(moments_s.begin(), moments_s.end(), [&](double moment_s) {
      return std::abs(static_cast<double>(row[0]) - moment_s) < kAroundMoment_s;
    });
  };
  const std::size_t interval = (2 * rows.size() + most - 1) / most;
  std::vector<FlownRow> fewer;
  for (std::size_t i = 0; i < rows.size();) {
    std::size_t end = std::min(i + 2, rows.size());
    if (is_kept(rows[i])) {
      fewer.insert(fewer.end(), rows.begin() + static_cast<std::ptrdiff_t>(i),
                   rows.begin() + static_cast<std::ptrdiff_t>(end));
    } else {
      while (end < std::min(i + interval, rows.size()) && !is_kept(rows[end])) ++end;
      for (const FlownRow& row : extremes_of(rows, i, end)) fewer.push_back(row);
    }
    i = end;
  }
  return fewer;
}

}  // namespace

const std::vector<FlownGroup>& flown_groups() {
  static const std::vector<FlownGroup> groups = {
      {"position", "m", {"x", "y", "z"}},
      {"set point position", "m", {"x", "y", "z"}},
      {"velocity", "m/s", {"x", "y", "z"}},
      {"set point velocity", "m/s", {"x", "y", "z"}},
      {"attitude", "degrees", {"roll", "pitch", "heading"}},
      {"body rate", "rad/s", {"x", "y", "z"}},
      {"thrust", "N", {"thrust"}},
      {"motor command", "0 .. 1", {"1", "2", "3", "4", "5", "6", "7", "8"}},
      {"battery", "V", {"battery"}},
      {"residual", "N", {"x", "y", "z"}},
      {"residual after", "N", {"x", "y", "z"}}};
  return groups;
}

std::vector<FlownFlight> flown_signals(const Inputs& inputs, const Inputs* fitted,
                                       const std::vector<Moment>& worst) {
  const std::vector<std::size_t> chosen = flights_that_fit(inputs, worst);
  std::size_t logs = 0;
  for (const std::size_t i : chosen) logs += inputs.found.flights[i].logs.size();
  std::vector<FlownFlight> flights;
  for (const std::size_t i : chosen) {
    FlownFlight flight{inputs.found.flights[i].name, {}};
    std::vector<std::string> problems;  // already reported by the comparison
    for (const Track& track : inputs.load(i, problems)) {
      if (track.instants.empty()) continue;
      std::vector<double> moments_s;
      for (const Moment& moment : worst)
        if (moment.path == track.path) moments_s.push_back(moment.time_s - track.clock_offset_s);
      flight.vehicles.push_back(flown_vehicle(track, inputs, fitted));
      std::vector<FlownRow>& rows = flight.vehicles.back().rows;
      rows = thinned(rows, kMostRows / std::max<std::size_t>(1, logs), moments_s);
    }
    if (!flight.vehicles.empty()) flights.push_back(std::move(flight));
  }
  return flights;
}

}  // namespace swarmcert::residuals
