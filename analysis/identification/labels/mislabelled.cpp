#include "analysis/identification/labels/mislabelled.h"

#include <fmt/core.h>

#include <algorithm>
#include <iterator>

#include "analysis/identification/labels/exchanged_streams.h"
#include "analysis/identification/labels/wrong_kind.h"
#include "nn/base/parallel.h"

namespace swarmcert::identification {
namespace {

using residuals::Track;
using What = Mislabelled::What;

/// Evidence in one flight, before any decision.
struct FlightLabels {
  std::vector<Mislabelled> logs;  ///< flight, vehicle, kind and path of each log
  Misfits set_points, sensors;
  std::vector<LogKind> kinds;

  /// Number of pairs of logs that were compared, in both directions.
  int tried() const { return 2 * set_points.logs * (set_points.logs - 1); }
};

FlightLabels labels_of(const residuals::Inputs& inputs, std::size_t flight) {
  if (inputs.found.flights[flight].logs.size() < 2 && inputs.models.size() < 2) return {};
  std::vector<std::string> problems;  // reported by the diagnosis
  const std::vector<Track> tracks = inputs.load(flight, problems);
  FlightLabels labels;
  for (const Track& track : tracks) {
    if (!track.position_only) labels.kinds.push_back(kind_of(inputs, track));
    Mislabelled log;
    log.flight = track.flight;
    log.vehicle = track.vehicle;
    log.kind = track.kind;
    log.path = track.path;
    if (!track.position_only) log.mass_kg = inputs.model_for(track).mass_kg;
    labels.logs.push_back(log);
  }
  if (tracks.size() < 2) return labels;
  labels.set_points = set_point_misfits(tracks);
  labels.sensors = sensor_misfits(tracks);
  return labels;
}

/// Returns the finding that a stream of log `log` of a flight belongs to log `to`.
/// @param fit, as_labelled pairs of `misfits`
Mislabelled stream(const FlightLabels& labels, What what, int log, int to, const Misfits& misfits,
                   std::pair<int, int> fit, std::pair<int, int> as_labelled) {
  Mislabelled found = labels.logs[static_cast<std::size_t>(log)];
  found.what = what;
  found.belongs_to = labels.logs[static_cast<std::size_t>(to)].vehicle;
  found.before = root_mean_square(misfits, as_labelled.first, as_labelled.second);
  found.after = root_mean_square(misfits, fit.first, fit.second);
  found.blocks = static_cast<int>(misfits.of(fit.first, fit.second).size());
  return found;
}

/// If two of setpoints, path and sensors agree, they outvote the third.
void judge_streams(const FlightLabels& labels, int tried, std::vector<Mislabelled>& found) {
  if (labels.set_points.logs == 0) return;
  const std::vector<int> set_points = belongs_to(labels.set_points, tried);
  const std::vector<int> paths = belongs_to(labels.sensors, tried);
  for (int log = 0; log < labels.set_points.logs; ++log) {
    const int set_point = set_points[static_cast<std::size_t>(log)];
    const int path = paths[static_cast<std::size_t>(log)];
    // The path of this vehicle is in the log `path` and follows the setpoints of this log, so only paths moved.
    const bool is_path = path != log && set_points[static_cast<std::size_t>(path)] == log;
    const bool is_moved_path = set_point != log && paths[static_cast<std::size_t>(set_point)] == log;
    if (is_path) {
      found.push_back(stream(labels, What::kPath, path, log, labels.sensors, {log, path}, {path, path}));
    } else if (path != log) {
      found.push_back(stream(labels, What::kSensors, log, path, labels.sensors, {log, path}, {log, log}));
    }
    if (set_point != log && !is_moved_path) {
      found.push_back(
          stream(labels, What::kSetPoints, log, set_point, labels.set_points, {log, set_point}, {log, log}));
    }
  }
}

Mislabelled label_of(const WrongKind& wrong, double mass_kg) {
  Mislabelled label;
  label.what = wrong.exchanged_with.empty() ? What::kKind : What::kName;
  label.flight = wrong.flight;
  label.vehicle = wrong.vehicle;
  label.kind = wrong.kind;
  label.path = wrong.path;
  label.belongs_to = wrong.exchanged_with.empty() ? wrong.is_kind : wrong.exchanged_with;
  label.is_sure = wrong.is_sure;
  label.before = wrong.before_m_s2;
  label.after = wrong.after_m_s2;
  label.mass_kg = mass_kg;
  label.blocks = wrong.blocks;
  label.flights = wrong.flights;
  return label;
}

void exchange_name(const Mislabelled& label, residuals::Inputs& inputs) {
  for (residuals::FlightFiles& flight : inputs.found.flights) {
    for (auto& [vehicle, path] : flight.logs) {
      if (path == label.path) vehicle = label.belongs_to;
    }
  }
}

void use_kind(const Mislabelled& label, residuals::Inputs& inputs) {
  if (label.path.empty()) {
    residuals::VehicleUse& use = inputs.fleet[label.vehicle];
    use.kind = label.belongs_to;
    use.model = inputs.model_of(label.belongs_to)->path;
    inputs.vehicle_models.erase(label.vehicle);
    return;
  }
  for (residuals::FlightFiles& flight : inputs.found.flights) {
    for (const auto& [vehicle, path] : flight.logs) {
      if (path == label.path) flight.position_only.insert(path);
    }
  }
}

}  // namespace

std::vector<Mislabelled> mislabelled(const residuals::Inputs& inputs, int jobs) {
  std::vector<FlightLabels> flights(inputs.found.flights.size());
  files::parallel_for(static_cast<int>(flights.size()), jobs, [&](int i) {
    flights[static_cast<std::size_t>(i)] = labels_of(inputs, static_cast<std::size_t>(i));
  });
  int tried = 0;
  std::vector<LogKind> kinds;
  for (FlightLabels& flight : flights) {
    tried += flight.tried();
    std::move(flight.kinds.begin(), flight.kinds.end(), std::back_inserter(kinds));
  }
  std::vector<Mislabelled> found;
  for (const FlightLabels& flight : flights) judge_streams(flight, tried, found);
  for (const WrongKind& wrong : wrong_kinds(kinds)) {
    const stability::Model* const model = inputs.model_of(wrong.kind);  // null if only logs have models
    found.push_back(label_of(wrong, model == nullptr ? 0 : model->mass_kg));
  }
  return found;
}

void correct_labels(const std::vector<Mislabelled>& found, residuals::Inputs& inputs) {
  for (const Mislabelled& label : found) {
    if (!label.is_sure) continue;
    if (label.what == What::kName) exchange_name(label, inputs);
    if (label.what == What::kKind) use_kind(label, inputs);
  }
}

std::vector<Mislabelled> find_and_correct_labels(residuals::Inputs& inputs, int jobs) {
  std::vector<Mislabelled> found = mislabelled(inputs, jobs);
  correct_labels(found, inputs);
  return found;
}

std::string in_words(const Mislabelled& label) {
  const std::string log = fmt::format("the log of {} ({})", label.vehicle, label.flight);
  switch (label.what) {
    case What::kSetPoints:
      return fmt::format(
          "{} of {} flew the set points in the log of {}: {:.3f} m from them (RMS), {:.3f} m from those in "
          "its own log",
          label.vehicle, label.flight, label.belongs_to, label.after, label.before);
    case What::kPath:
      return fmt::format(
          "the path in {} is that of {}: its velocity and that vehicle's accelerometer differ by {:.3f} "
          "m/s^2, and by {:.3f} m/s^2 from the accelerometer of the same log",
          log, label.belongs_to, label.after, label.before);
    case What::kSensors:
      return fmt::format(
          "the sensors and duties in {} are those of {}: the accelerometer and that vehicle's velocity "
          "differ by {:.3f} m/s^2, and by {:.3f} m/s^2 from the velocity in the same log",
          log, label.belongs_to, label.after, label.before);
    case What::kName:
      return fmt::format(
          "{} is that of {}: its model leaves {:.3f} m/s^2 along the thrust axis, that of {} {:.3f} m/s^2",
          log, label.belongs_to, label.after, label.vehicle, label.before);
    case What::kKind:
      break;
  }
  return fmt::format(
      "{}{} flies as one of the kind {}: its model leaves {:.3f} m/s^2 along the thrust axis, that of {} "
      "{:.3f} m/s^2{}",
      label.vehicle, label.flight.empty() ? "" : " of " + label.flight, label.belongs_to, label.after,
      label.kind, label.before,
      label.is_sure ? "" : "; a thrust ratio, another mass or a payload explains it as well");
}

}  // namespace swarmcert::identification
