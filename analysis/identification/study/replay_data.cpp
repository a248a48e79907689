#include "analysis/identification/study/replay_data.h"

#include <algorithm>
#include <limits>

#include "analysis/identification/study/residual_under.h"

namespace swarmcert::identification {
namespace {

constexpr std::size_t kMostFlights = 4;
constexpr std::size_t kMostRows = 1500;  // per vehicle
constexpr double kShortestStep_s = 0.1;

/// Returns indices of flights without repetition: those with the worst moments first.
std::vector<std::size_t> chosen_flights(const residuals::Inputs& inputs,
                                        const std::vector<residuals::Moment>& worst) {
  std::vector<std::size_t> chosen;
  const auto choose = [&chosen](std::size_t flight) {
    if (chosen.size() < kMostFlights && std::find(chosen.begin(), chosen.end(), flight) == chosen.end())
      chosen.push_back(flight);
  };
  const std::vector<residuals::FlightFiles>& flights = inputs.found.flights;
  for (const residuals::Moment& moment : worst) {
    for (std::size_t i = 0; i < flights.size(); ++i)
      if (flights[i].name == moment.flight) choose(i);
  }
  for (std::size_t i = 0; i < flights.size(); ++i) choose(i);
  return chosen;
}

void set_force(const Eigen::Vector3d& force_N, std::size_t first, std::array<float, 10>& row) {
  for (std::size_t axis = 0; axis < 3; ++axis)
    row[first + axis] = static_cast<float>(force_N[static_cast<Eigen::Index>(axis)]);
}

ReplayVehicle replay_of(const residuals::Track& track, const residuals::Inputs& inputs,
                        const stability::Model& before, const stability::Model& after) {
  ReplayVehicle vehicle;
  vehicle.name = track.vehicle;
  const bool has_force = !track.position_only && track.kind == before.kind;
  std::vector<Eigen::Vector3d> was, is;
  if (has_force) {
    was = residual_under(before, inputs, track);
    is = residual_under(after, inputs, track);
  }
  const double duration_s = track.instants.back().time_s - track.instants.front().time_s;
  const double step_s = std::max(kShortestStep_s, duration_s / static_cast<double>(kMostRows));
  double next_s = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < track.instants.size(); ++i) {
    const stability::Instant& now = track.instants[i];
    if (now.time_s < next_s || !now.p_W_m.allFinite()) continue;
    next_s = now.time_s + step_s;
    std::array<float, 10> row;
    row.fill(std::numeric_limits<float>::quiet_NaN());
    row[0] = static_cast<float>(now.time_s);
    set_force(now.p_W_m, 1, row);
    if (has_force && track.cut[i] == residuals::Cut::kNone) {
      set_force(was[i], 4, row);
      set_force(is[i], 7, row);
    }
    vehicle.rows.push_back(row);
  }
  return vehicle;
}

}  // namespace

std::vector<ReplayFlight> replay_data(const residuals::Inputs& inputs, const stability::Model& before,
                                      const stability::Model& after,
                                      const std::vector<residuals::Moment>& worst) {
  std::vector<ReplayFlight> replay;
  for (const std::size_t flight : chosen_flights(inputs, worst)) {
    std::vector<std::string> problems;  // already reported by the comparison
    ReplayFlight shown{inputs.found.flights[flight].name, {}};
    for (const residuals::Track& track : inputs.load(flight, problems)) {
      if (!track.has_height || track.instants.empty()) continue;
      ReplayVehicle vehicle = replay_of(track, inputs, before, after);
      if (!vehicle.rows.empty()) shown.vehicles.push_back(std::move(vehicle));
    }
    if (!shown.vehicles.empty()) replay.push_back(std::move(shown));
  }
  return replay;
}

}  // namespace swarmcert::identification
