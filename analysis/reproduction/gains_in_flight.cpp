// Tracking errors of gains used in flight, predicted from the gains: calibrated on some flights, reported on others.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "analysis/reproduction/experiments.h"
#include "analysis/reproduction/flight_parts.h"
#include "analysis/reproduction/ranks.h"
#include "analysis/tracking/peak_model.h"
#include "nn/base/input_error.h"
#include "stability/gains.h"
#include "stability/model.h"

namespace swarmcert::reproduction {
namespace {

using analysis::ConformalThreshold;
using analysis::FlightScore;
using analysis::FlownPeak;
using analysis::PeakModel;

struct AxisFlight {
  const GainFlight* flight = nullptr;
  std::size_t axis = 0;
  const FlownAxis& flown() const { return flight->axes[axis]; }
  std::string group() const { return gain_set(*flight, axis); }
};

std::vector<AxisFlight> on_track(const GainFolder& folder, Track track) {
  std::vector<AxisFlight> result;
  for (const GainFlight& flight : folder.flights)
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (track_of(flight, axis) == track && flight.axes[axis].peak_m > 0) result.push_back({&flight, axis});
  return result;
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return n == 0 ? NAN : (values[(n - 1) / 2] + values[n / 2]) / 2;
}

/// Actual force over commanded force for vehicles with these motors; over all vehicles if none had them.
double thrust_ratio(const std::vector<AxisFlight>& calibrating, const std::string& motors) {
  std::vector<double> same, all;
  for (const AxisFlight& one : calibrating) {
    all.push_back(one.flight->thrust_ratio);
    if (one.flight->gains.motors == motors) same.push_back(one.flight->thrust_ratio);
  }
  return median(same.empty() ? all : same);
}

FlownPeak flown_peak(const AxisFlight& one, double ratio, FlightParts& parts) {
  const double rounded = std::round(100 * ratio) / 100;
  return {one.group(), one.flown().peak_m, steady_error_m(*one.flight, one.axis, rounded),
          parts.of(*one.flight, one.axis, rounded)};
}

/// The basis of a prediction: flights of other gain sets, or all calibrating flights.
struct Calibration {
  std::vector<AxisFlight> flights;
  std::map<std::string, double> ratios;
  PeakModel model;
  /// Blind to the gains: the median peak for the same setpoint and motors in other gain sets.
  ConformalThreshold blind;

  double ratio(const std::string& motors) const {
    const auto found = ratios.find(motors);
    return found == ratios.end() ? thrust_ratio(flights, motors) : found->second;
  }
  double blind_m(const AxisFlight& one, const std::string& without) const {
    const std::string wanted = set_point_class(*one.flight, one.axis);
    std::vector<double> same, all;
    for (const AxisFlight& other : flights) {
      if (other.group() == without) continue;
      all.push_back(other.flown().peak_m);
      if (set_point_class(*other.flight, other.axis) == wanted) same.push_back(other.flown().peak_m);
    }
    return median(same.empty() ? all : same);
  }
};

Calibration calibration(std::vector<AxisFlight> flights, double level, FlightParts& parts) {
  Calibration result;
  result.flights = std::move(flights);
  for (const AxisFlight& one : result.flights) {
    const std::string& motors = one.flight->gains.motors;
    if (result.ratios.count(motors) == 0) result.ratios[motors] = thrust_ratio(result.flights, motors);
  }
  std::vector<FlownPeak> peaks;
  std::vector<FlightScore> blind;
  for (const AxisFlight& one : result.flights) {
    peaks.push_back(flown_peak(one, result.ratio(one.flight->gains.motors), parts));
    blind.push_back({one.group(), one.flown().peak_m / result.blind_m(one, one.group())});
  }
  result.model = calibrate_peaks(peaks, level);
  result.blind = conformal_threshold(blind, level);
  return result;
}

/// All calibrations of one track: one for each gain set left out, and one with all.
class Calibrations {
 public:
  Calibrations(std::vector<AxisFlight> flights, const Setting& setting, CascadePlant plant)
      : flights_(std::move(flights)), level_(setting.coverage), plant_(plant), parts_(plant) {
    for (const AxisFlight& one : flights_) hashes_.insert(one.flight->sha256);
  }

  /// A calibrating flight is judged by the calibration without its gain set.
  std::string left_out_for(const AxisFlight& one) const {
    return hashes_.count(one.flight->sha256) > 0 ? one.group() : "";
  }
  const Calibration& without(const std::string& group) {
    const auto found = known_.find(group);
    if (found != known_.end()) return found->second;
    std::vector<AxisFlight> others;
    for (const AxisFlight& one : flights_)
      if (group.empty() || one.group() != group) others.push_back(one);
    return known_.emplace(group, calibration(std::move(others), level_, parts_)).first->second;
  }
  int groups_without_one() const {
    std::set<std::string> names;
    for (const AxisFlight& one : flights_) names.insert(one.group());
    return static_cast<int>(names.size()) - 1;
  }
  FlightParts& parts() { return parts_; }
  const CascadePlant& plant() const { return plant_; }
  const std::vector<AxisFlight>& flights() const { return flights_; }

 private:
  std::vector<AxisFlight> flights_;
  std::set<std::string> hashes_;
  double level_;
  CascadePlant plant_;
  FlightParts parts_;
  std::map<std::string, Calibration> known_;
};

struct Judged {
  AxisFlight one;
  double bound_m = 0, blind_m = 0;
  stability::CascadeMargins margins;
  bool extrapolates = false, left_gain_set_out = false;
  bool holds() const { return bound_m >= one.flown().peak_m; }
};

Judged judge(const AxisFlight& one, Calibrations& calibrations) {
  Judged judged;
  judged.one = one;
  const std::string left_out = calibrations.left_out_for(one);
  judged.left_gain_set_out = !left_out.empty();
  const Calibration& from = calibrations.without(left_out);
  const double ratio = from.ratio(one.flight->gains.motors);
  const FlownPeak flight = flown_peak(one, ratio, calibrations.parts());
  judged.margins = cascade_margins(flown_cascade(*one.flight, one.axis, calibrations.plant(), ratio));
  judged.bound_m = from.model.bound_m(flight);
  judged.extrapolates = from.model.extrapolates(flight) || from.ratios.count(one.flight->gains.motors) == 0;
  judged.blind_m = from.blind.threshold * from.blind_m(one, one.group());
  return judged;
}

struct Summary {
  std::size_t flights = 0, gain_sets = 0;
  double coverage = 0, coverage_of_gain_sets = 0, median_ratio = 0;
  double blind_coverage = 0, blind_ratio = 0;
  double rank = NAN, rank_rms = NAN;  ///< over gain sets, of mean values
};

Summary summary(const std::vector<Judged>& judged) {
  Summary result;
  result.flights = judged.size();
  struct Mean {
    double bound = 0, peak = 0, rms = 0, held = 0, count = 0;
  };
  std::map<std::string, Mean> sets;
  std::vector<double> ratios, blind_ratios;
  for (const Judged& row : judged) {
    const double peak_m = row.one.flown().peak_m;
    ratios.push_back(row.bound_m / peak_m);
    blind_ratios.push_back(row.blind_m / peak_m);
    const auto n = static_cast<double>(judged.size());
    result.coverage += row.holds() ? 1 / n : 0;
    result.blind_coverage += row.blind_m >= peak_m ? 1 / n : 0;
    Mean& mean = sets[row.one.group()];
    mean.bound += row.bound_m;
    mean.peak += peak_m;
    mean.rms += row.one.flown().rms_m;
    mean.held += row.holds() ? 1 : 0;
    ++mean.count;
  }
  result.gain_sets = sets.size();
  result.median_ratio = median(ratios);
  result.blind_ratio = median(blind_ratios);
  std::vector<double> bounds, peaks, rms;
  for (const auto& [name, mean] : sets) {
    bounds.push_back(mean.bound / mean.count);
    peaks.push_back(mean.peak / mean.count);
    rms.push_back(mean.rms / mean.count);
    result.coverage_of_gain_sets += mean.held / mean.count / static_cast<double>(sets.size());
  }
  result.rank = rank_correlation(bounds, peaks);
  result.rank_rms = rank_correlation(bounds, rms);
  return result;
}

void describe(files::Record& record, const Summary& s) {
  record.field("flights", s.flights, "");
  record.field("gain_sets", s.gain_sets, "");
  record.field("coverage", s.coverage, "Share of the flights whose peak stays below the bound.");
  record.field("coverage_of_gain_sets", s.coverage_of_gain_sets, "Mean over gain sets.");
  record.field("median_ratio", s.median_ratio, "Bound over peak.");
  record.field("blind_ratio", s.blind_ratio, "Likewise, of a bound that is blind to the gains.");
  record.field("blind_coverage", s.blind_coverage, "Of that bound.");
  record.field("rank", s.rank, "Rank correlation of mean bound and mean peak, over gain sets.");
  record.field("rank_rms", s.rank_rms, "Likewise, with the mean RMS of the error.");
}

/// Summary of the flights with the same motors and set point.
struct ClassRow {
  std::string name;
  Summary summary;
};

void describe(files::Record& record, const ClassRow& row) {
  record.field("name", row.name, "Motors, and range and speed of the set point.");
  describe(record, row.summary);
}

struct AxisRow {
  Track track = Track::kAlong;
  Summary summary;
  PeakModel model;
  double level = 0;
  std::vector<ClassRow> classes;
};

void describe(files::Record& record, const AxisRow& row) {
  const ConformalThreshold& promise = row.model.promise;
  record.field("axis", track_name(row.track), "Along the set point's motion, across it, or vertically.");
  describe(record, row.summary);
  record.object("calibrated", "By which flights.", [&](files::Record& r) {
    r.field("flights", promise.flights, "");
    r.field("gain_sets", promise.groups, "");
    r.field("level", row.level, "Probability that is asked for.");
    r.field("interval", promise.coverage_90, "90 %, of the coverage of the calibration at hand.");
    r.field("multiplier", promise.threshold, "Of the prediction.");
  });
  struct Part {
    std::string name;
    double size = 0;
    std::string unit;
  };
  std::vector<Part> parts;
  for (std::size_t k = 0; k < row.model.weights.size(); ++k)
    if (row.model.weights[k] > 0) parts.push_back({part_names()[k], row.model.weights[k], part_units()[k]});
  record.list("disturbances", parts, "Fitted sizes.", [](files::Record& r, const Part& part) {
    r.field("name", part.name, "");
    r.field("size", part.size, "");
    r.field("unit", part.unit, "");
  });
  record.field("set_points", row.classes, "The same by motors and set point.");
}

struct FlightRow {
  std::string log, gain_set;
  Track track = Track::kAlong;
  std::size_t axis = 0;
  double bound_m = 0, peak_m = 0, rms_m = 0, blind_m = 0;
  bool left_gain_set_out = false, extrapolates = false;
  stability::CascadeMargins margins;
  stability::Nearness nearness = stability::Nearness::kClear;
};

void describe(files::Record& record, const FlightRow& row) {
  record.field("log", row.log, "");
  record.field("axis", track_name(row.track), "Along the set point's motion, across it, or vertically.");
  record.field("world_axis", std::string(1, "xyz"[row.axis]), "x, y or z.");
  record.field("bound", row.bound_m, "On the peak.", "m", "upper bound with the stated coverage");
  record.field("peak", row.peak_m, "Largest error that was flown.", "m");
  record.field("rms", row.rms_m, "", "m");
  record.field("blind", row.blind_m, "Bound that is blind to the gains.", "m");
  record.field("gain_set", row.gain_set, "The gains that act on this axis.");
  record.field("gain_set_left_out", row.left_gain_set_out, "Whether it was judged by the others.");
  record.field("extrapolates", row.extrapolates, "Unlike the calibrating flights: nothing is promised.");
  record.object("margins", "Of the linear loop.", [&](files::Record& r) {
    r.field("gain", row.margins.gain, "Factor; null: any.");
    r.field("delay_s", row.margins.delay_s, "", "s");
    r.field("damping", row.margins.damping, "Of the least damped poles.");
    r.field("frequency_rad_s", row.margins.frequency_rad_s, "Likewise.", "rad/s");
    r.field("verdict", name(row.nearness), "clear, close to a limit cycle, or unstable.");
  });
}

struct GainsResult {
  double coverage = 0;
  std::vector<AxisRow> axes;
  std::vector<FlightRow> flights;
  std::vector<std::string> calibrated_on;
  std::vector<std::pair<std::string, std::string>> left_out;
  bool leaves_out = false;
};

void describe(files::Record& record, const GainsResult& result) {
  record.field("coverage", result.coverage, "Probability with which a flight stays below its bound.");
  record.field("axes", result.axes, "Coverage and sharpness of the bounds, axis by axis.");
  record.field("flights", result.flights, "Bound and peak, flight by flight and axis by axis.");
  record.field("calibrated_on", result.calibrated_on, "Logs of the calibration.");
  record.list("left_out", result.left_out, "Logs that were left out.", [](files::Record& r, const auto& one) {
    r.field("log", one.first, "");
    r.field("why", one.second, "");
  });
  record.field("leave_gain_set_out", result.leaves_out, "Whether a gain set is judged by the others.");
}

AxisRow axis_row(Track track, const std::vector<Judged>& judged, Calibrations& calibrations, double level) {
  AxisRow row = {track, summary(judged), calibrations.without("").model, level, {}};
  std::map<std::string, std::vector<Judged>> classes;
  for (const Judged& one : judged) classes[set_point_class(*one.one.flight, one.one.axis)].push_back(one);
  for (const auto& [name, members] : classes) row.classes.push_back({name, summary(members)});
  return row;
}

FlightRow flight_row(Track track, const Judged& judged) {
  const AxisFlight& one = judged.one;
  return {one.flight->log,
          one.group(),
          track,
          one.axis,
          judged.bound_m,
          one.flown().peak_m,
          one.flown().rms_m,
          judged.blind_m,
          judged.left_gain_set_out,
          judged.extrapolates,
          judged.margins,
          nearness_to_limit_cycle(judged.margins)};
}

analysis::Table summary_table(const files::Node& list, const char* first, const char* head) {
  return analysis::table(list, {{first, head},
                                {"flights"},
                                {"gain_sets"},
                                {"coverage", "", "{:.3f}"},
                                {"median_ratio", "bound/peak", "{:.2f}"},
                                {"blind_ratio", "gain-blind", "{:.2f}"},
                                {"blind_coverage", "coverage", "{:.3f}"},
                                {"rank", "", "{:.2f}"},
                                {"rank_rms", "rank of RMS", "{:.2f}"}});
}

void show_gains(const GainsResult& result, Finding& finding) {
  finding.add(fmt::format("Predicted {:g} % bound over flown peak error", 100 * result.coverage),
              summary_table(*finding.fields.find("axes"), "axis", ""));
  for (const AxisRow& axis : result.axes)
    finding.add(fmt::format("The same by motors and set point, {}", track_name(axis.track)),
                summary_table(files::record_of(axis.classes), "name", "set point"));
  std::vector<FlightRow> above, near;
  for (const FlightRow& row : result.flights) {
    if (row.bound_m < row.peak_m) above.push_back(row);
    if (row.nearness != stability::Nearness::kClear) near.push_back(row);
  }
  finding.add("Flights above their bound",
              analysis::table(files::record_of(above), {{"log", "flight"},
                                                        {"axis"},
                                                        {"world_axis", ""},
                                                        {"bound", "", "{:.1f}", 1000, "mm"},
                                                        {"peak", "", "{:.1f}", 1000, "mm"},
                                                        {"gain_set", "gains"}}));
  finding.add("Gains that are close to a limit cycle, or unstable in the linear model",
              analysis::table(files::record_of(near), {{"log", "flight"},
                                                       {"axis"},
                                                       {"world_axis", ""},
                                                       {"margins.gain", "gain margin", "{:.2f}"},
                                                       {"margins.damping", "", "{:.3f}"},
                                                       {"margins.frequency_rad_s", "", "{:.1f}"},
                                                       {"margins.verdict"},
                                                       {"gain_set", "gains"}}));
  for (const AxisRow& axis : result.axes) {
    const ConformalThreshold& promise = axis.model.promise;
    finding.notes.push_back(
        fmt::format("{}: calibrated on {} flights with {} gain sets. A flight of a further gain set, drawn "
                    "like these, stays below its bound with probability {:g}; for the calibration at hand "
                    "between {:.3f} and {:.3f} (90 %).",
                    track_name(axis.track), promise.flights, promise.groups, axis.level,
                    promise.coverage_90.lower, promise.coverage_90.upper));
  }
}

/// One point per flight and axis; the line is bound = peak.
void add_figure(const std::map<Track, std::vector<Judged>>& judged, Finding& finding) {
  std::string data, plots;
  int block = 0;
  double least_mm = INFINITY, largest_mm = 0;
  for (const auto& [track, rows] : judged) {
    if (rows.empty()) continue;
    if (block > 0) data += "\n\n";
    for (const Judged& row : rows) {
      const double peak_mm = 1000 * row.one.flown().peak_m, bound_mm = 1000 * row.bound_m;
      data += fmt::format("{:.6g} {:.6g}\n", peak_mm, bound_mm);
      least_mm = std::min({least_mm, peak_mm, bound_mm});
      largest_mm = std::max({largest_mm, peak_mm, bound_mm});
    }
    plots += fmt::format(", 'gains_in_flight.dat' index {} using 1:2 with points pointtype {} title '{}'",
                         block, block + 5, track_name(track));
    ++block;
  }
  finding.figures.push_back(
      {"gains_in_flight", data,
       fmt::format("set logscale xy\nset grid\nset key top left\nset xlabel 'flown peak error [mm]'\nset "
                   "ylabel 'predicted bound [mm]'\nset xrange [{:.4g}:{:.4g}]\nset yrange "
                   "[{:.4g}:{:.4g}]\nplot x with lines linecolor rgb '#888888' title 'bound = peak'{}\n",
                   0.8 * least_mm, 1.25 * largest_mm, 0.8 * least_mm, 1.25 * largest_mm, plots),
       "Predicted bound over flown peak error, one point per flight and axis. Below the line the bound did "
       "not hold."});
}

void refuse_too_few(const GainFolder& folder, Track track, int groups, bool leaves_out, double level) {
  const int fewest = std::max(analysis::fewest_groups(level), 5);
  if (groups >= fewest) return;
  throw files::InputError(
      {folder.path, "", "--calibrate", "",
       fmt::format("has {} gain sets {}{}, and a promise of {:g} needs at least {}", groups,
                   track == Track::kVertical ? "vertically" : track_name(track) + std::string(" track"),
                   leaves_out ? " in addition to the one left out" : "", level, fewest),
       "calibrate on more flights, or ask for less with --coverage"});
}

std::vector<std::string> inputs_of(const GainFolder& calibrating, const GainFolder& reported) {
  std::set<std::string> inputs(calibrating.inputs.begin(), calibrating.inputs.end());
  inputs.insert(reported.inputs.begin(), reported.inputs.end());
  return {inputs.begin(), inputs.end()};
}

Finding run_gains_in_flight(const Setting& setting) {
  if (setting.calibrate.empty() || setting.flights.empty()) {
    throw files::InputError(
        {"reproduce gains-in-flight", "", "--calibrate, --flights", "", "are both needed",
         "name two folders with logs/ and info/, or the same one twice: each gain set is then "
         "judged by the others"});
  }
  const GainFolder calibrating = read_gain_folder(setting.calibrate, setting);
  const bool is_same = setting.flights == setting.calibrate;
  const GainFolder reported = is_same ? calibrating : read_gain_folder(setting.flights, setting);
  const stability::Model model = stability::read_model(setting.models + "/crazyflie-small.toml");
  const CascadePlant plant = {model.inertia_kg_m2, stability::load_gains(setting.gains).motor_lag_s};
  GainsResult result;
  result.coverage = setting.coverage;
  for (const GainFlight& flight : calibrating.flights) result.calibrated_on.push_back(flight.log);
  result.left_out = calibrating.left_out;
  if (!is_same)
    result.left_out.insert(result.left_out.end(), reported.left_out.begin(), reported.left_out.end());
  std::map<Track, std::vector<Judged>> judged;
  int done = 0;
  bool extrapolates = false;
  for (const Track track : {Track::kAlong, Track::kAcross, Track::kVertical}) {
    const std::vector<AxisFlight> flights = on_track(reported, track);
    if (flights.empty()) continue;
    Calibrations calibrations(on_track(calibrating, track), setting, plant);
    const bool needs_another = std::any_of(flights.begin(), flights.end(), [&](const AxisFlight& one) {
      return !calibrations.left_out_for(one).empty();
    });
    refuse_too_few(calibrating, track, calibrations.groups_without_one() + (needs_another ? 0 : 1),
                   needs_another, setting.coverage);
    for (const AxisFlight& one : flights) {
      judged[track].push_back(judge(one, calibrations));
      result.flights.push_back(flight_row(track, judged[track].back()));
      result.leaves_out |= result.flights.back().left_gain_set_out;
      extrapolates |= result.flights.back().extrapolates;
      if (setting.progress)
        setting.progress(++done, 3 * static_cast<int>(reported.flights.size()), "bounds, one per axis");
    }
    result.axes.push_back(axis_row(track, judged[track], calibrations, setting.coverage));
  }
  Finding finding;
  finding.inputs = inputs_of(calibrating, reported);
  finding.fields = files::record_of(result);
  show_gains(result, finding);
  add_figure(judged, finding);
  if (result.leaves_out) {
    finding.notes.push_back(
        "Flights that are also among the calibrating ones were judged without their gain set: fit, thrust "
        "ratio and multiplier come from the others.");
  }
  if (extrapolates) {
    finding.notes.push_back(
        "Flights marked 'extrapolates' have motors, or a part of the bound, beyond all calibrating flights: "
        "they are not like them, and the promise does not cover them.");
  }
  finding.notes.push_back(
      "The set of parts was chosen on the flights of the collection that are numbered 8 to 148 and not "
      "divisible by five; sizes and multiplier are fitted to the calibrating flights alone.");
  for (const auto& [log, why] : result.left_out)
    finding.notes.push_back(fmt::format("Left out: {}, {}.", log, why));
  return finding;
}

}  // namespace

Experiment gains_in_flight() {
  return experiment<GainsResult>(
      "gains-in-flight", "errors of gains that flew, predicted from the gains: --calibrate, --flights",
      run_gains_in_flight);
}

}  // namespace swarmcert::reproduction
