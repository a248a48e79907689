#include "analysis/commands/shared/time_plots.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>

#include "analysis/residuals/failing_place.h"

namespace swarmcert::analysis {
namespace {

using residuals::FlownFlight;
using residuals::FlownGroup;
using residuals::FlownVehicle;

/// Calls `visit` with each of the worst moments, its rank from 1, and the track that it belongs to.
void each_moment(
    const residuals::Comparison& comparison,
    const std::function<void(const residuals::Moment&, int, const residuals::TrackErrors&)>& visit) {
  int rank = 0;
  for (const residuals::Moment& moment : comparison.moments) {
    ++rank;
    for (const residuals::TrackErrors& track : comparison.tracks)
      if (track.path == moment.path) visit(moment, rank, track);
  }
}

/// Whether some row of a flight knows the column.
bool has_values(const std::vector<FlownFlight>& flights, std::size_t column) {
  for (const FlownFlight& flight : flights) {
    for (const FlownVehicle& vehicle : flight.vehicles) {
      const auto& rows = vehicle.rows;
      if (std::any_of(rows.begin(), rows.end(), [&](const auto& row) { return std::isfinite(row[column]); }))
        return true;
    }
  }
  return false;
}

/// The part of the logs that a page holds.
std::string embedded_words(const std::vector<FlownFlight>& flights, std::size_t all_logs) {
  std::size_t logs = 0, thinned = 0, rows = 0, records = 0;
  for (const FlownFlight& flight : flights) {
    for (const FlownVehicle& vehicle : flight.vehicles) {
      ++logs;
      rows += vehicle.rows.size();
      records += vehicle.records;
      thinned += vehicle.rows.size() < vehicle.records ? 1 : 0;
    }
  }
  const std::string which = fmt::format("This page holds {} of {} logs{}", logs, all_logs,
                                        logs < all_logs ? ", those with the worst moments first" : "");
  if (thinned == 0) return which + ", with all of their records.";
  return fmt::format(
      "{}; {} of them as the least and largest values of short intervals ({} rows for {} records), complete "
      "only around the worst moments.",
      which, thinned, rows, records);
}

}  // namespace

void add_moments(Report& report, const residuals::Comparison& comparison, const residuals::ForceUnit& unit) {
  std::vector<ShownMoment> shown;
  each_moment(comparison, [&](const residuals::Moment& moment, int, const residuals::TrackErrors& track) {
    shown.push_back({track.flight, track.vehicle, moment.time_s - track.clock_offset_s, moment.time_s,
                     fmt::format("{:.3g} {}", moment.residual_N.norm() * unit.per_newton(), unit.name)});
  });
  if (shown.empty()) return;
  report.paragraph("The worst moments of the given model, means over 0.1 s:");
  report.moments(shown);
}

void add_flown(Report& report, const std::vector<FlownFlight>& flights,
               const residuals::Comparison& comparison, const residuals::ForceUnit& unit) {
  if (flights.empty()) {
    report.heading("Over time");
    report.paragraph("This page holds no signals of the logs.");
    return;
  }
  Flown flown;
  flown.force_unit = unit.name;
  flown.axis = residuals::failing_axis(comparison.overall.statistics);
  std::vector<std::pair<std::size_t, float>> columns = {{0, 1.0F}};  // column and factor
  std::size_t first = 1;
  for (const FlownGroup& group : residuals::flown_groups()) {
    const bool is_force = group.unit == std::string("N");
    const bool is_needed = group.name == std::string("residual") || group.name == std::string("position") ||
                           group.name == std::string("velocity");
    bool any = is_needed;
    for (std::size_t k = 0; k < group.columns.size(); ++k) any = any || has_values(flights, first + k);
    if (any) flown.groups.push_back({group.name, is_force ? unit.name : group.unit, {}});
    for (std::size_t k = 0; k < group.columns.size() && any; ++k) {
      flown.groups.back().columns.emplace_back(group.columns[k]);
      columns.emplace_back(first + k, is_force ? static_cast<float>(unit.per_newton()) : 1.0F);
    }
    first += group.columns.size();
  }
  for (const FlownFlight& flight : flights) {
    for (const FlownVehicle& vehicle : flight.vehicles) {
      flown.logs.push_back({flight.name, vehicle.name, {}});
      for (const auto& [column, factor] : columns) {
        std::vector<float>& values = flown.logs.back().columns.emplace_back();
        for (const residuals::FlownRow& row : vehicle.rows) values.push_back(row[column] * factor);
      }
    }
  }
  each_moment(comparison,
              [&](const residuals::Moment& moment, int rank, const residuals::TrackErrors& track) {
                flown.marks.push_back({track.flight, track.vehicle, moment.time_s - track.clock_offset_s,
                                       rank, moment.residual_N.norm() * unit.per_newton()});
              });
  report.flown(
      flown,
      embedded_words(flights, comparison.tracks.size()) +
          " Drag over a curve to zoom, double click to see all. Flags mark the worst moments; signals "
          "that do not change are left out.",
      "Whole trajectories of all vehicles of a flight; grey where the residual is not judged. Drag, or "
      "use the arrow keys, to turn; + and - zoom.");
}

}  // namespace swarmcert::analysis
