#include "analysis/commands/compare/compare_result.h"

#include <cmath>
#include <limits>

#include "analysis/commands/compare/budget_output.h"
#include "analysis/commands/compare/log_output.h"
#include "analysis/commands/shared/plausibility_output.h"
#include "analysis/residuals/failing_place.h"
#include "stability/bounds/tracking_bounds.h"

namespace swarmcert::analysis {
namespace {

using files::Record;
using residuals::Comparison;

constexpr double kNotJudged = std::numeric_limits<double>::quiet_NaN();
const Eigen::Vector3d kAllJudged = Eigen::Vector3d::Ones();
/// The unit that the field `unit` states: N, or m/s^2 where no mass is known.
constexpr char kForceUnit[] = "force";

// Numbers along axes that cannot be judged are null.

void add(Record& record, const char* name, const residuals::Axes& axes, const Eigen::Vector3d& judged,
         const char* meaning, const char* unit = "") {
  const auto one = [&judged](double value, int axis) { return judged[axis] != 0 ? value : kNotJudged; };
  record.field(name, files::AxesAndTotal{one(axes.x, 0), one(axes.y, 1), one(axes.z, 2), axes.total}, meaning,
               unit);
}

void add(Record& record, const char* name, const Eigen::Vector3d& v, const Eigen::Vector3d& judged,
         const char* meaning, const char* unit = "") {
  const auto one = [&](int axis) { return judged[axis] != 0 ? v[axis] : kNotJudged; };
  record.field(name, files::Axes{one(0), one(1), one(2)}, meaning, unit);
}

void describe_statistics(Record& record, const residuals::ErrorStatistics& s, const Eigen::Vector3d& judged) {
  record.field("samples", s.samples, "Used records.");
  add(record, "rmse", s.rmse, judged, "Root mean square of the residual.");
  add(record, "bias", s.bias, judged, "Its mean; total: length of the mean vector.");
  add(record, "p95", s.p95, judged, "95 % quantile of its magnitude.");
  add(record, "p999", s.p999, judged, "99.9 % quantile of its magnitude.");
  add(record, "max", s.max, judged, "Its largest magnitude.");
  add(record, "variance_explained", s.variance_explained, judged,
      "1 - variance of the residual over that without effects.");
}

void describe_group(Record& record, const residuals::GroupErrors& g, const Eigen::Vector3d& judged) {
  describe_statistics(record, g.statistics, judged);
  record.object("rmse_interval_90", "Of the RMSE, from blocks of 2 s; null: too few.", [&](Record& r) {
    const char* const kAxes[] = {"x", "y", "z", "total"};
    for (int k = 0; k < 4; ++k) {
      const bool has = g.rmse_interval && (k == 3 || judged[k] != 0);
      r.field(kAxes[k], has ? std::optional((*g.rmse_interval)[static_cast<std::size_t>(k)]) : std::nullopt,
              "");
    }
  });
  add(record, "nrmse", g.nrmse, judged, "RMSE over the mean weight.");
  add(record, "low_band_to_floor", g.low_band_to_floor, judged,
      "Power of the residual at low frequencies over that of its noise floor.");
  add(record, "noise_floor", g.noise_floor_N, judged, "RMS of the noise.");
}

std::vector<std::string> axes_of(const Eigen::Vector3d& judged) {
  std::vector<std::string> axes;
  for (int k = 0; k < 3; ++k)
    if (judged[k] != 0) axes.emplace_back(stability::axis_name(k));
  return axes;
}

const char* name(logs::ThrustSource source) {
  const char* const kNames[] = {"none", "duty and battery", "commanded force",
                                "multiples of the hover thrust"};
  return kNames[static_cast<int>(source)];
}

const char* name(logs::ForceSource source) {
  const char* const kNames[] = {"none", "accelerometer", "derivative of the velocity",
                                "second derivative of the position"};
  return kNames[static_cast<int>(source)];
}

void describe_trajectory(Record& record, const residuals::TrajectoryErrors& trajectory) {
  const bool is_refused = !trajectory.refused.empty();
  const auto axes = [&](Record& r, const char* name, const residuals::Axes& a, const char* meaning) {
    add(r, name, a, kAllJudged, meaning, "m");
  };
  record.may("refused", is_refused ? std::optional(trajectory.refused) : std::nullopt,
             "Why nothing was simulated.");
  record.may_fields(!is_refused, [&](Record& r) {
    r.field("seconds", trajectory.seconds, "Of judged flight.", "s");
    r.field("pieces", trajectory.pieces, "Stretches that were simulated.");
    r.field("diverged", trajectory.diverged, "");
    axes(r, "rmse", trajectory.rmse, "Simulated minus measured position.");
    axes(r, "max", trajectory.max, "Likewise.");
    axes(r, "measured_rms", trajectory.measured_rms, "Measured position minus set point.");
    axes(r, "measured_max", trajectory.measured_max, "Likewise.");
    axes(r, "simulated_rms", trajectory.simulated_rms, "Simulated position minus set point.");
    axes(r, "simulated_max", trajectory.simulated_max, "Likewise.");
    axes(r, "replayed_max", trajectory.replayed_max, "Likewise, with the residual applied as a force.");
  });
}

void describe_trajectories(Record& record, const residuals::Trajectories& all) {
  const bool is_refused = !all.refused.empty();
  record.may("refused", is_refused ? std::optional(all.refused) : std::nullopt, "Why nothing was simulated.");
  record.may_fields(!is_refused, [&](Record& r) {
    r.constant("unit", "m", "");
    r.constant("loop", "sampled", "");
    r.field("tracks", all.tracks, "");
    r.field("diverged", all.diverged, "");
    r.field("seconds", all.seconds, "", "s");
    r.field("settle_s", residuals::TrajectoryErrors::kSettle_s, "Not judged at the start.", "s");
    add(r, "rmse", all.rmse_m, kAllJudged, "Simulated minus measured position.", "m");
    add(r, "max", all.max_m, kAllJudged, "Likewise.", "m");
    add(r, "measured_rms", all.measured_rms_m, kAllJudged, "Distance from the set point.", "m");
    add(r, "simulated_rms", all.simulated_rms_m, kAllJudged, "Likewise.", "m");
  });
}

/// @param has_speed the log shows how fast the vehicle is
void describe_torque(Record& record, const residuals::TorqueErrors& torque, bool has_speed) {
  const bool is_refused = !torque.refused.empty();
  const auto axes = [](Record& r, const char* name, const residuals::Axes& a) {
    add(r, name, a, kAllJudged, "About the body axes.", "N m");
  };
  record.may("refused", is_refused ? std::optional(torque.refused) : std::nullopt,
             "Why there is no residual.");
  record.may_fields(!is_refused, [&](Record& r) {
    r.constant("unit", "N m", "");
    r.field("records", torque.records, "");
    r.field("rate_hz", torque.rate_hz, "Of the log.", "Hz");
  });
  record.object_or_null(
      torque.slow_records > 0, "slow_flight", "What balances the rotors in slow flight.", [&](Record& r) {
        r.constant("unit", "N m", "");
        r.field("slower_than_m_s",
                has_speed ? std::optional(residuals::TorqueErrors::kSlow_m_s) : std::nullopt,
                "Null: the log shows no speed, and the mean is that of the whole flight.", "m/s");
        r.field("records", torque.slow_records, "");
        axes(r, "mean", torque.slow_mean_Nm);
      });
  record.may_fields(!is_refused, [&](Record& r) {
    axes(r, "rmse", torque.rmse_Nm);
    axes(r, "bias", torque.bias_Nm);
    axes(r, "max", torque.max_Nm);
  });
}

/// The largest values over the windows of a flight.
void describe_largest(Record& record, const residuals::ErrorOfFlight& error, const Eigen::Vector3d& judged) {
  const auto axes = [&](const char* name, const Eigen::Vector4d& v) {
    add(record, name, residuals::Axes{v[0], v[1], v[2], v[3]}, judged, "");
  };
  const residuals::ErrorWindow largest = error.windows.empty() ? residuals::ErrorWindow() : error.largest();
  record.field("windows", error.windows.size(), "");
  axes("bias", error.bias);
  axes("amplitude", largest.amplitude);
  axes("rate", largest.rate);
  axes("variation", largest.variation);
  axes("impulse", largest.impulse);
}

void describe_place_residual(Record& record, const residuals::PlaceResidual& place) {
  const auto three = [](const Eigen::Vector3d& v) { return std::array<double, 3>{v[0], v[1], v[2]}; };
  record.field("cell", place.cell,
               "Height of the neighbour and lateral distance, counted from the grid's least.");
  record.field("records", place.records, "");
  record.field("least", three(place.least_N), "", kForceUnit);
  record.field("largest", three(place.largest_N), "", kForceUnit);
}

void describe_errors_of_flight(Record& record, const residuals::TrackErrors& track,
                               const ErrorsOfFlights& errors) {
  const auto found = errors.by_log.find(track.path);
  const bool is_found = found != errors.by_log.end();
  const residuals::FlightError error = is_found ? found->second : residuals::FlightError();
  const Eigen::Vector3d judged = track.position_only ? kAllJudged : track.judged;
  record.object_or_null(is_found, "learning_error", "Largest over windows; null: no force is judged.",
                        [&](Record& r) { describe_largest(r, error.force, judged); });
  record.object_or_null(is_found && !error.velocity.windows.empty(), "velocity_error",
                        "Likewise of the estimated velocity less the slope of the estimated position.",
                        [&](Record& r) { describe_largest(r, error.velocity, kAllJudged); });
  // A tube needs all three axes.
  record.list_or_null(
      is_found && judged == kAllJudged, "residual_by_place", error.places,
      "Range of the residual, averaged over place_grid.mean_s, while the neighbour was in each cell of "
      "place_grid; cell -1, -1: none was within it. Null: an axis is not judged.",
      describe_place_residual);
}

/// A track with the errors that only a single flight has.
struct FlightRow {
  const residuals::TrackErrors* track = nullptr;
  const std::optional<ErrorsOfFlights>* errors = nullptr;
};

void describe_flight(Record& record, const FlightRow& row) {
  static const residuals::TrackErrors kOfShape;
  const residuals::TrackErrors& track = row.track != nullptr ? *row.track : kOfShape;
  const bool has_clock = track.has_reference_clock || track.has_absolute_clock || track.clock_onsets > 0;
  record.field("flight", track.flight, "");
  record.field("scenario", track.scenario, "");
  record.field("vehicle", track.vehicle, "");
  record.field("kind", track.kind, "");
  record.field("composition", track.composition, "Kinds of the neighbours, then of the vehicle.");
  record.field("file", track.path, "");
  record.field("position_only", track.position_only, "A neighbour, whose force is not judged.");
  record.field("clock", clock_of(track), "reference, absolute, estimated or unknown.");
  record.field("clock_offset_s", has_clock ? std::optional(track.clock_offset_s) : std::nullopt,
               "Against the first log of the flight; null: unknown.", "s");
  record.field("clock_onsets", track.clock_onsets, "Common starts of a movement that it is based on.");
  record.field("findings", track.findings, "What was wrong with the log.");
  record.field("plausibility", track.doubts, "Implausible values.");
  std::vector<std::pair<std::string, std::size_t>> records;
  for (std::size_t k = 0; k < track.cut.size(); ++k)
    records.emplace_back(residuals::name(static_cast<residuals::Cut>(k)), track.cut[k]);
  record.field("records", records, "By what became of them.");
  record.may_fields(!track.position_only, [&](Record& r) {
    const bool has_torque = track.torque.refused.empty() || track.torque.slow_records > 0;
    r.object("judged", "Axes along and about which the log lets force and torque be judged.",
             [&](Record& inner) {
               inner.field("force", axes_of(track.judged), "");
               inner.field("torque", axes_of(has_torque ? kAllJudged : Eigen::Vector3d::Zero()), "");
             });
    r.field("thrust", name(track.thrust_source), "What it was computed from.");
    r.field("specific_force", name(track.force_source), "Likewise.");
  });
  describe_group(record, track.errors, track.position_only ? kAllJudged : track.judged);
  record.object("trajectory", "The closed loop, simulated from the set points.",
                [&](Record& r) { describe_trajectory(r, track.trajectory); });
  record.object("torque", "Torque residual.", [&](Record& r) {
    describe_torque(r, track.torque, track.force_source != logs::ForceSource::kNone);
  });
  const std::optional<ErrorsOfFlights> none;
  const std::optional<ErrorsOfFlights>& errors = row.errors != nullptr ? *row.errors : none;
  record.may_fields(errors.has_value(), [&](Record& r) {
    describe_errors_of_flight(r, track, errors ? *errors : ErrorsOfFlights());
  });
}

void describe_quantiles(Record& record, const residuals::LearningError::Quantiles& q, const char* name,
                        const char* unit, const Eigen::Vector3d& judged) {
  record.object(name, "Quantiles over windows.", [&](Record& r) {
    add(r, "p50", q.p50, judged, "", unit);
    add(r, "p95", q.p95, judged, "", unit);
    add(r, "p99", q.p99, judged, "", unit);
    add(r, "max", q.max, judged, "", unit);
  });
}

void describe_learning_error(Record& record, const Comparison& comparison) {
  const residuals::LearningError& learning = comparison.learning_error;
  const Eigen::Vector3d& judged = comparison.judged;
  record.field("windows", learning.windows, "");
  record.field("window_s", residuals::LearningError::kWindow_s, "", "s");
  record.field("bandwidth_hz", residuals::LearningError::kBandwidth_hz, "", "Hz");
  describe_quantiles(record, learning.bias_N, "bias", kForceUnit, judged);
  describe_quantiles(record, learning.amplitude_N, "amplitude", kForceUnit, judged);
  describe_quantiles(record, learning.rate_N_s, "rate", "force/s", judged);
  describe_quantiles(record, learning.variation_N, "variation", kForceUnit, judged);
  describe_quantiles(record, learning.impulse_N_s, "impulse", "force s", judged);
  const residuals::Trajectories::PeakRatio& ratio = comparison.trajectories.peak_ratio;
  record.object_or_null(
      ratio.tracks > 0, "peak_ratio",
      "Largest measured over largest replayed tracking error, per track; null: none was replayed.",
      [&](Record& r) {
        add(r, "p50", ratio.p50, judged, "");
        add(r, "p95", ratio.p95, judged, "");
        add(r, "max", ratio.max, judged, "");
        add(r, "coverage", ratio.coverage, judged, "Share of tracks with a ratio of at most 1.");
        r.field("tracks", ratio.tracks, "");
      });
}

void describe_velocity_error(Record& record, const residuals::VelocityError& error) {
  record.field("windows", error.windows, "");
  record.field("window_s", residuals::LearningError::kWindow_s, "", "s");
  record.field("slope_s", residuals::kSlopeWindow_s, "Over which the slope of the position is taken.", "s");
  record.field("bandwidth_hz", residuals::LearningError::kBandwidth_hz, "", "Hz");
  describe_quantiles(record, error.bias_m_s, "bias", "m/s", kAllJudged);
  describe_quantiles(record, error.amplitude_m_s, "amplitude", "m/s", kAllJudged);
  describe_quantiles(record, error.rate_m_s2, "rate", "m/s^2", kAllJudged);
  describe_quantiles(record, error.variation_m_s, "variation", "m/s", kAllJudged);
  describe_quantiles(record, error.impulse_m, "impulse", "m", kAllJudged);
}

struct MapCell {
  double height_m = 0, lateral_m = 0;
  std::size_t records = 0;
  double bias_z = 0, rmse_z = 0;
};

std::vector<MapCell> cells_of(const residuals::NeighbourMap& map) {
  using Map = residuals::NeighbourMap;
  std::vector<MapCell> cells;
  for (int i = 0; i < Map::kHeights; ++i) {
    for (int j = 0; j < Map::kLateral; ++j) {
      const Map::Cell& cell = map.cells[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
      if (cell.records == 0) continue;
      const auto n = static_cast<double>(cell.records);
      cells.push_back({Map::kLowest_m + (i + 0.5) * Map::kHeightStep_m, (j + 0.5) * Map::kLateralStep_m,
                       cell.records, cell.sum_N / n, std::sqrt(cell.squares_N2 / n)});
    }
  }
  return cells;
}

void describe_map(Record& record, const residuals::NeighbourMap& map) {
  record.field("meaning",
               "neighbour above the vehicle by height_m, laterally away by lateral_m; middles of cells", "");
  record.list("cells", cells_of(map), "", [](Record& r, const MapCell& cell) {
    r.field("height_m", cell.height_m, "", "m");
    r.field("lateral_m", cell.lateral_m, "", "m");
    r.field("records", cell.records, "");
    r.field("bias_z", cell.bias_z, "Mean of the vertical residual.");
    r.field("rmse_z", cell.rmse_z, "");
  });
}

void add_groups(Record& record, const char* name, const std::map<std::string, residuals::GroupErrors>& groups,
                const char* meaning, const Eigen::Vector3d& judged) {
  std::vector<std::pair<std::string, residuals::GroupErrors>> members(groups.begin(), groups.end());
  record.entries(name, members, meaning, [&judged](Record& r, const residuals::GroupErrors& group) {
    describe_group(r, group, judged);
  });
}

void describe_grid(Record& record) {
  using Grid = residuals::PlaceGrid;
  record.field("lowest_m", Grid::kLowest_m, "", "m");
  record.field("height_step_m", Grid::kHeightStep_m, "", "m");
  record.field("heights", Grid::kHeights, "");
  record.field("lateral_step_m", Grid::kLateralStep_m, "", "m");
  record.field("laterals", Grid::kLateral, "");
  record.field("mean_s", residuals::kPlaceMean_s, "Over which the residual is averaged.", "s");
}

/// Mean square of the vertical residual by composition, in gf^2, the unit of the published networks.
std::vector<std::pair<std::string, double>> mean_squares_gf2(const Comparison& comparison) {
  std::vector<std::pair<std::string, double>> squares;
  for (const auto& [name, group] : comparison.compositions)
    squares.emplace_back(name, std::pow(group.statistics.rmse.z / stability::kGramForce_N, 2));
  return squares;
}

std::vector<std::pair<std::string, std::string>> cut_rules() {
  std::vector<std::pair<std::string, std::string>> rules;
  for (int k = 1; k < static_cast<int>(residuals::Cut::kCount); ++k) {
    const auto cut = static_cast<residuals::Cut>(k);
    rules.emplace_back(residuals::name(cut), residuals::rule(cut));
  }
  return rules;
}

void describe_comparison(Record& record, const CompareResult& result) {
  const Comparison& comparison = result.comparison;
  const residuals::Inputs& inputs = result.inputs;
  const Eigen::Vector3d& judged = comparison.judged;
  const bool per_mass = inputs.rules.per_mass;
  record.field("unit", per_mass ? "m/s^2" : "N", "Of every force: m/s^2 where no model is known.");
  record.object("judged", "Axes along which every log lets a force be judged.",
                [&](Record& r) { r.field("force", axes_of(judged), ""); });
  record.object("overall", "Over all used records.",
                [&](Record& r) { describe_group(r, comparison.overall, judged); });
  std::vector<FlightRow> flights;
  for (const residuals::TrackErrors& track : comparison.tracks) flights.push_back({&track, &result.errors});
  record.list("flights", flights, "One per vehicle and flight.", describe_flight);
  add_groups(record, "scenarios", comparison.scenarios, "By scenario.", judged);
  add_groups(record, "vehicles", comparison.vehicles, "By vehicle.", judged);
  add_groups(record, "kinds", comparison.kinds, "By kind of vehicle.", judged);
  add_groups(record, "compositions", comparison.compositions,
             "By the kinds of the neighbours and of the vehicle.", judged);
  record.field("mean_square_z_gf2", per_mass ? std::nullopt : std::optional(mean_squares_gf2(comparison)),
               "Mean square of the vertical residual by composition.", "gf^2");
  record.may("fails",
             per_mass ? std::nullopt : std::optional(residuals::failing_place(comparison, result.unit)),
             "Where the model fails, in one line.");
  record.list("regions", comparison.regions, "Where the model fails, worst first.",
              [&](Record& r, const residuals::RegionErrors& region) {
                r.field("variable", residuals::variable_name(region.variable), "");
                r.field("words", residuals::region_words(region, result.unit), "");
                r.field("share", region.share, "Of all squared residual that this region's bias explains.");
                describe_statistics(r, region.statistics, judged);
              });
  record.object("neighbour_map", "Vertical residual over the place of the nearest neighbour.",
                [&](Record& r) { describe_map(r, comparison.neighbours); });
  record.list("moments", comparison.moments, "Worst moments, worst first.",
              [&judged](Record& r, const residuals::Moment& moment) {
                r.field("flight", moment.flight, "");
                r.field("vehicle", moment.vehicle, "");
                r.field("time_s", moment.time_s, "Of the log's clock.", "s");
                add(r, "residual", moment.residual_N, judged, "Mean over 0.1 s.");
              });
  record.object("learning_error", "Quantiles over windows of the residual.",
                [&](Record& r) { describe_learning_error(r, comparison); });
  record.object("trajectory", "The closed loop, simulated from the set points.",
                [&](Record& r) { describe_trajectories(r, comparison.trajectories); });
  record.field("cut_rules", cut_rules(), "By name of a cut: the rule by which records are left out.");
  record.object("clocks", "How the clocks of several logs were related: numbers of logs.",
                [&](Record& r) { describe_clocks(r, comparison); });
  const TorqueSummary torque = torque_summary(comparison);
  record.object("torque", "Logs with a torque residual.", [&](Record& r) {
    const bool has_some = torque.tracks > 0;
    r.may("refused", has_some ? std::nullopt : std::optional(torque.refused), "Why no log has one.");
    r.may("tracks", has_some ? std::optional(torque.tracks) : std::nullopt, "");
    r.may("where", has_some ? std::optional<std::string>("flights[].torque") : std::nullopt, "");
  });
  record.field("problems", comparison.problems, "Logs that could not be read, and why.");
  const std::vector<CollectionRow> rows = collection_rows(inputs.words, outcomes_of(comparison, inputs));
  record.may("collections", rows.empty() ? std::nullopt : std::optional(rows),
             "Per folder: logs, how many can be judged along which axis, and why others cannot.");
  std::vector<std::string> left_out = inputs.found.left_out;
  for (const auto& [copy, first] : inputs.found.copies)
    left_out.push_back(copy + ": has the bytes of " + first);
  record.field("left_out", left_out, "Logs that were left out, with the reason.");
  record.field("skipped_files", inputs.found.skipped, "Files in the folders that are no logs.");
}

struct AxisOfPromise {
  int axis = 0;
  double bound_m = 0;
  KeptAlong along;
};

void describe_promise(Record& record, const JudgedPromise& judged) {
  std::vector<AxisOfPromise> axes;
  for (std::size_t i = 0; i < 3; ++i)
    axes.push_back({static_cast<int>(i), judged.promise.bound_m[i], judged.kept.axes[i]});
  record.field("file", judged.file, "Result of bound --coverage.");
  record.field("level", judged.promise.level, "Probability that was promised.");
  record.list("axes", axes, "", [](Record& r, const AxisOfPromise& one) {
    r.field("axis", stability::axis_name(one.axis), "");
    r.field("bound", one.bound_m, "Null: none was promised.", "m");
    r.constant("unit", "m", "");
    r.field("flights", one.along.flights, "With a set point along the axis.");
    r.field("held", one.along.held, "In which no vehicle exceeded the bound.");
    r.field("share", one.along.flights > 0 ? std::optional(one.along.share()) : std::nullopt, "");
    r.field("interval_90", one.along.interval_90, "Of the probability that a flight stays below.");
  });
  record.field("left_out", judged.kept.used, "Logs from which the promise was made.");
}

}  // namespace

/// The outcome for every log: axes with records that were compared.
std::vector<LogOutcome> outcomes_of(const Comparison& comparison, const residuals::Inputs& inputs) {
  std::map<std::string, const residuals::TrackErrors*> tracks;
  for (const residuals::TrackErrors& track : comparison.tracks) tracks[track.path] = &track;
  std::vector<LogOutcome> outcomes;
  for (const residuals::FlightFiles& flight : inputs.found.flights) {
    for (const auto& [vehicle, path] : flight.logs) {
      LogOutcome outcome;
      outcome.path = path;
      const auto found = tracks.find(path);
      outcome.opened = found != tracks.end();
      const bool is_used = outcome.opened && found->second->used_s > 0;
      if (!outcome.opened)
        outcome.left_out_why = "unreadable";
      else if (found->second->position_only)
        outcome.left_out_why = "only a neighbour";
      else if (!is_used)
        outcome.left_out_why = "no usable record";
      for (int k = 0; k < 3 && is_used; ++k) outcome.force[k] = found->second->judged[k] != 0;
      if (is_used) {
        const residuals::TorqueErrors& torque = found->second->torque;
        outcome.torque = torque.refused.empty() || torque.slow_records > 0;
        outcome.seconds = found->second->used_s;
      }
      outcomes.push_back(outcome);
    }
  }
  return outcomes;
}

TorqueSummary torque_summary(const Comparison& comparison) {
  TorqueSummary summary{0, "no vehicle has a model"};
  for (const residuals::TrackErrors& track : comparison.tracks) {
    if (track.torque.refused.empty()) ++summary.tracks;
    if (!track.torque.refused.empty() && !track.position_only) summary.refused = track.torque.refused;
  }
  return summary;
}

void describe(Record& record, const CompareResult& result) {
  describe_comparison(record, result);
  record.may_fields(result.errors.has_value(), [&](Record& r) {
    const auto velocity = result.errors ? result.errors->velocity : std::nullopt;
    r.object("place_grid", "Cells of the place of the laterally nearest neighbour, seen from the vehicle.",
             describe_grid);
    r.object_or_null(
        velocity.has_value(), "velocity_error",
        "Of the estimated velocity less the slope of the estimated position; null: not measured.",
        [&](Record& inner) {
          describe_velocity_error(inner, velocity.value_or(residuals::VelocityError()));
        });
  });
  record.may("mean_square_z_gf2_own_filter",
             result.own ? std::optional(mean_squares_gf2(*result.own)) : std::nullopt,
             "With --published-filter: under this project's own cuts.", "gf^2");
  record.may_object(result.budget.has_value(), "budget", "How the error falls effect by effect.",
                    [&](Record& r) { describe_budget(r, result.budget.value_or(identification::Budget())); });
  record.may_object(result.injected.has_value(), "injected", "Logs that --inject wrote.", [&](Record& r) {
    const InjectedLogs injected = result.injected.value_or(InjectedLogs());
    r.field("loop", "open: vehicles do not react", "");
    r.field("logs", injected.logs, "With the force added.");
    r.field("unchanged", injected.unchanged, "Of vehicles without a model.");
  });
  record.may_object(result.promise.has_value(), "promise",
                    "How often the promise of bound --coverage held on flights that it was not made from.",
                    [&](Record& r) { describe_promise(r, result.promise.value_or(JudgedPromise())); });
  record.may_fields(result.prediction.has_value(), [&](Record& r) {
    const std::optional<Prediction> prediction = result.prediction.value_or(std::nullopt);
    r.field("prediction", prediction, "From each measured state; null: no flight could be predicted.");
  });
}

}  // namespace swarmcert::analysis
