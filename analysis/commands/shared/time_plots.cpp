#include "analysis/commands/shared/time_plots.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

namespace swarmcert::analysis {

std::string series_name(const residuals::TrackErrors& track) { return track.flight + " " + track.vehicle; }

namespace {

constexpr std::size_t kMostSeries = 12;

/// Logs with the worst moments first, then the others.
std::vector<const residuals::TrackErrors*> tracks_to_show(const residuals::Comparison& comparison,
                                                          const std::vector<residuals::Moment>& worst) {
  std::vector<const residuals::TrackErrors*> chosen;
  const auto choose = [&](const residuals::TrackErrors& track) {
    if (chosen.size() < kMostSeries && !track.series.empty() &&
        std::find(chosen.begin(), chosen.end(), &track) == chosen.end())
      chosen.push_back(&track);
  };
  for (const residuals::Moment& moment : worst) {
    for (const residuals::TrackErrors& track : comparison.tracks)
      if (moment.path == track.path) choose(track);
  }
  for (const residuals::TrackErrors& track : comparison.tracks) choose(track);
  return chosen;
}

/// The vertical residual by time of the same log in another comparison.
std::map<float, float> vertical_by_time(const residuals::Comparison* comparison,
                                        const residuals::TrackErrors& track) {
  std::map<float, float> vertical;
  if (comparison == nullptr) return vertical;
  for (const residuals::TrackErrors& other : comparison->tracks) {
    if (other.path != track.path) continue;
    for (const std::array<float, 5>& row : other.series) vertical[row[0]] = row[3];
  }
  return vertical;
}

TimeSeries time_series_of(const residuals::TrackErrors& track, const std::vector<residuals::Moment>& worst,
                          const residuals::Comparison* before, double per_newton) {
  constexpr float kBreak_s = 0.1F;
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  const std::map<float, float> was = vertical_by_time(before, track);
  const auto scale = static_cast<float>(per_newton);
  TimeSeries series;
  series.name = series_name(track);
  float last_s = track.series.front()[0];
  for (const std::array<float, 5>& row : track.series) {
    if (row[0] - last_s > kBreak_s)
      series.rows.push_back({(row[0] + last_s) / 2, kNaN, kNaN, kNaN, kNaN, kNaN});
    last_s = row[0];
    const auto other = was.find(row[0]);
    series.rows.push_back({row[0], row[1] * scale, row[2] * scale, row[3] * scale, row[4] * scale,
                           other == was.end() ? kNaN : other->second * scale});
  }
  for (std::size_t k = 0; k < worst.size(); ++k) {
    const residuals::Moment& moment = worst[k];
    if (moment.path != track.path) continue;
    const auto nearest =
        std::min_element(track.series.begin(), track.series.end(), [&](const auto& a, const auto& b) {
          return std::abs(static_cast<double>(a[0]) - moment.time_s) <
                 std::abs(static_cast<double>(b[0]) - moment.time_s);
        });
    series.marks.push_back({(*nearest)[0], static_cast<int>(k) + 1, moment.residual_N.norm() * per_newton});
  }
  return series;
}

}  // namespace

void add_time_series(Report& report, const residuals::Comparison& comparison,
                     const residuals::Comparison* before, const std::string& unit, double per_newton) {
  std::vector<TimeSeries> all;
  const std::vector<residuals::Moment>& worst = (before == nullptr ? comparison : *before).moments;
  for (const residuals::TrackErrors* track : tracks_to_show(comparison, worst))
    all.push_back(time_series_of(*track, worst, before, per_newton));
  if (all.empty()) return;
  report.heading("Over time");
  report.time_series(
      all, unit,
      fmt::format("Force residual of {} of {} logs, those with the worst moments first; drag to "
                  "zoom, double click to zoom out. Flags mark the worst moments.",
                  all.size(), comparison.tracks.size()));
}

}  // namespace swarmcert::analysis
