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

files::Json summary_json(const Summary& s) {
  return {{"flights", s.flights},
          {"gain_sets", s.gain_sets},
          {"coverage", s.coverage},
          {"coverage_of_gain_sets", s.coverage_of_gain_sets},
          {"median_ratio", s.median_ratio},
          {"blind_ratio", s.blind_ratio},
          {"blind_coverage", s.blind_coverage},
          {"rank", s.rank},
          {"rank_rms", s.rank_rms}};
}

std::vector<std::string> summary_row(const std::string& name, const Summary& s) {
  const auto rank = [](double value) {
    return std::isfinite(value) ? fmt::format("{:.2f}", value) : std::string("-");
  };
  return {name,
          std::to_string(s.flights),
          std::to_string(s.gain_sets),
          fmt::format("{:.3f}", s.coverage),
          fmt::format("{:.2f}", s.median_ratio),
          fmt::format("{:.2f} at {:.3f}", s.blind_ratio, s.blind_coverage),
          rank(s.rank),
          rank(s.rank_rms)};
}

const std::vector<std::string>& summary_header() {
  static const std::vector<std::string> header = {"",           "flights",    "gain sets", "coverage",
                                                  "bound/peak", "gain-blind", "rank",      "rank of RMS"};
  return header;
}

void add_axis(Track track, const std::vector<Judged>& judged, Calibrations& calibrations, double level,
              Finding& finding) {
  const Summary all = summary(judged);
  files::Json row = {{"axis", track_name(track)}};
  row.update(summary_json(all));
  const PeakModel& model = calibrations.without("").model;
  row["calibrated"] = {{"flights", model.promise.flights},
                       {"gain_sets", model.promise.groups},
                       {"level", level},
                       {"interval", model.promise.coverage_90},
                       {"multiplier", model.promise.threshold}};
  row["disturbances"] = files::Json::array();
  for (std::size_t k = 0; k < model.weights.size(); ++k) {
    if (model.weights[k] > 0)
      row["disturbances"].push_back(
          {{"name", part_names()[k]}, {"size", model.weights[k]}, {"unit", part_units()[k]}});
  }
  finding.tables[0].rows.push_back(summary_row(track_name(track), all));
  std::map<std::string, std::vector<Judged>> classes;
  for (const Judged& one : judged) classes[set_point_class(*one.one.flight, one.one.axis)].push_back(one);
  row["set_points"] = files::Json::array();
  for (const auto& [name, members] : classes) {
    const Summary of_class = summary(members);
    row["set_points"].push_back({{"name", name}});
    row["set_points"].back().update(summary_json(of_class));
    finding.tables[1].rows.push_back(summary_row(std::string(track_name(track)) + ", " + name, of_class));
  }
  finding.notes.push_back(
      fmt::format("{}: calibrated on {} flights with {} gain sets. A flight of a further gain set, drawn "
                  "like these, stays below its bound with probability {:g}; for the calibration at hand "
                  "between {:.3f} and {:.3f} (90 %).",
                  track_name(track), model.promise.flights, model.promise.groups, level,
                  model.promise.coverage_90.lower, model.promise.coverage_90.upper));
  finding.json["axes"].push_back(std::move(row));
}

void add_flight(Track track, const Judged& judged, Finding& finding) {
  const AxisFlight& one = judged.one;
  const stability::Nearness nearness = nearness_to_limit_cycle(judged.margins);
  finding.json["flights"].push_back({{"log", one.flight->log},
                                     {"axis", track_name(track)},
                                     {"world_axis", std::string(1, "xyz"[one.axis])},
                                     {"bound", judged.bound_m},
                                     {"peak", one.flown().peak_m},
                                     {"rms", one.flown().rms_m},
                                     {"blind", judged.blind_m},
                                     {"gain_set", one.group()},
                                     {"gain_set_left_out", judged.left_gain_set_out},
                                     {"extrapolates", judged.extrapolates},
                                     {"margins",
                                      {{"gain", judged.margins.gain},
                                       {"delay_s", judged.margins.delay_s},
                                       {"damping", judged.margins.damping},
                                       {"frequency_rad_s", judged.margins.frequency_rad_s},
                                       {"verdict", name(nearness)}}}});
  if (nearness != stability::Nearness::kClear) {
    finding.tables[3].rows.push_back(
        {one.flight->log, fmt::format("{} ({})", track_name(track), "xyz"[one.axis]),
         fmt::format("{:.2f}", judged.margins.gain), fmt::format("{:.3f}", judged.margins.damping),
         fmt::format("{:.1f}", judged.margins.frequency_rad_s), name(nearness), one.group()});
  }
  if (judged.holds()) return;
  finding.tables[2].rows.push_back({one.flight->log,
                                    fmt::format("{} ({})", track_name(track), "xyz"[one.axis]),
                                    fmt::format("{:.1f}", 1000 * judged.bound_m),
                                    fmt::format("{:.1f}", 1000 * one.flown().peak_m), one.group()});
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

void begin(const GainFolder& calibrating, const GainFolder& reported, const Setting& setting,
           Finding& finding) {
  finding.json["coverage"] = setting.coverage;
  finding.json["axes"] = finding.json["flights"] = files::Json::array();
  finding.json["calibrated_on"] = files::Json::array();
  for (const GainFlight& flight : calibrating.flights) finding.json["calibrated_on"].push_back(flight.log);
  finding.json["left_out"] = files::Json::array();
  for (const GainFolder* folder : {&calibrating, &reported}) {
    for (const auto& [log, why] : folder->left_out) {
      finding.json["left_out"].push_back({{"log", log}, {"why", why}});
    }
    if (calibrating.path == reported.path) break;
  }
  finding.tables.push_back(
      {fmt::format("Predicted {:g} % bound over flown peak error", 100 * setting.coverage),
       summary_header(),
       {}});
  finding.tables.push_back({"The same by motors and set point", summary_header(), {}});
  finding.tables.push_back(
      {"Flights above their bound [mm]", {"flight", "axis", "bound", "peak", "gains"}, {}});
  finding.tables.push_back({"Gains that are close to a limit cycle, or unstable in the linear model",
                            {"flight", "axis", "gain margin", "damping", "rad/s", "", "gains"},
                            {}});
  finding.inputs = calibrating.inputs;
  finding.inputs.insert(finding.inputs.end(), reported.inputs.begin(), reported.inputs.end());
  std::sort(finding.inputs.begin(), finding.inputs.end());
  finding.inputs.erase(std::unique(finding.inputs.begin(), finding.inputs.end()), finding.inputs.end());
}

}  // namespace

Finding gains_in_flight(const Setting& setting) {
  if (setting.calibrate.empty() || setting.flights.empty()) {
    throw files::InputError(
        {"reproduce gains-in-flight", "", "--calibrate, --flights", "", "are both needed",
         "name two folders with logs/ and info/, or the same one twice: each gain set is then "
         "judged by the others"});
  }
  const GainFolder calibrating = read_gain_folder(setting.calibrate, setting);
  const GainFolder reported =
      setting.flights == setting.calibrate ? calibrating : read_gain_folder(setting.flights, setting);
  const stability::Model model = stability::read_model(setting.models + "/crazyflie-small.toml");
  const CascadePlant plant = {model.inertia_kg_m2, stability::load_gains(setting.gains).motor_lag_s};
  Finding finding;
  begin(calibrating, reported, setting, finding);
  std::map<Track, std::vector<Judged>> judged;
  int done = 0;
  bool leaves_out = false, extrapolates = false;
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
      leaves_out |= judged[track].back().left_gain_set_out;
      extrapolates |= judged[track].back().extrapolates;
      add_flight(track, judged[track].back(), finding);
      if (setting.progress)
        setting.progress(++done, 3 * static_cast<int>(reported.flights.size()), "bounds, one per axis");
    }
    add_axis(track, judged[track], calibrations, setting.coverage, finding);
  }
  add_figure(judged, finding);
  finding.json["leave_gain_set_out"] = leaves_out;
  if (leaves_out) {
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
  for (const auto& row : finding.json["left_out"])
    finding.notes.push_back(
        fmt::format("Left out: {}, {}.", row["log"].get<std::string>(), row["why"].get<std::string>()));
  return finding;
}

}  // namespace swarmcert::reproduction
