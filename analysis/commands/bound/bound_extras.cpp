#include "analysis/commands/bound/bound_extras.h"

#include <fmt/core.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "analysis/commands/bound/bound_output.h"
#include "analysis/tracking/tube/error_loops.h"
#include "analysis/tracking/usual_uncertainty.h"
#include "nn/base/input_error.h"
#include "nn/base/parallel.h"
#include "stability/bounds/enclosures/verified_norms.h"
#include "stability/bounds/enclosures/verified_sampled_norms.h"
#include "stability/bounds/uncertain/uncertain_norms.h"

namespace swarmcert::analysis {
namespace {

using files::Json;
using namespace stability;  // NOLINT: every name below is of that library

/// Parses "0.032:0.037".
Interval range_of(const std::string& word, const std::string& text) {
  char* end = nullptr;
  Interval range;
  range.lower = std::strtod(text.c_str(), &end);
  const bool has_colon = end != text.c_str() && *end == ':';
  const char* second = has_colon ? end + 1 : end;
  if (has_colon) range.upper = std::strtod(second, &end);
  if (!has_colon || end == second || *end != '\0' || !(range.lower <= range.upper) || !(range.lower >= 0) ||
      !std::isfinite(range.upper)) {
    throw UsageError("--uncertain " + word + ": write NAME=FROM:TO, e.g. mass=0.032:0.037");
  }
  return range;
}

/// Rejects an interval that appears to be in another unit: battery in mV, times in ms, thrust scale in percent.
void check_range(const std::string& word, const std::string& name, const Interval& range,
                 const Model& model) {
  constexpr double kLongest_s = 1, kLargestScale = 10;
  std::string problem;
  if (name == "battery") {
    problem = battery_problem(model, range.lower);
    if (problem.empty()) problem = battery_problem(model, range.upper);
  } else if ((name == "lag" || name == "delay") && range.upper > kLongest_s) {
    problem = fmt::format("{:g} is longer than 1 s; {} is in seconds: 20 ms are 0.02", range.upper, name);
  } else if (name == "thrust" && range.upper > kLargestScale) {
    problem = fmt::format("{:g} times the modelled thrust; thrust is a factor: 90 % are 0.9", range.upper);
  }
  if (!problem.empty()) throw UsageError("--uncertain " + word + ": " + problem);
}

/// The parameter intervals of the vehicle; the battery interval acts on the thrust.
UncertainPlant intervals_of(const Tracking& input, const std::vector<std::string>& words) {
  UncertainPlant plant = usual_uncertainty(input.gains, input.plant);
  for (const std::string& word : words) {
    if (word == "default") continue;
    const std::size_t equals = word.find('=');
    const std::string name = word.substr(0, equals);
    const Interval range = range_of(word, equals == std::string::npos ? "" : word.substr(equals + 1));
    check_range(word, name, range, input.model);
    if (name == "mass" && range.lower > 0) {
      const double lifted_kg = input.plant.largest_thrust_N / kGravity_m_s2;
      if (lifted_kg > 0 && range.lower > lifted_kg) {
        throw UsageError(
            fmt::format("--uncertain {}: the rotors lift {:.3g} kg; mass is in kg", word, lifted_kg));
      }
      plant.mass_kg = range;
    } else if (name == "thrust" && range.lower > 0) {
      plant.thrust_scale = range;
    } else if (name == "lag") {
      plant.lag_s = range;
    } else if (name == "delay") {
      plant.delay_s = range;
    } else if (name == "battery" && range.lower > 0) {
      // Thrust at the PWM that hovers with a full battery, without voltage compensation.
      const auto rotors = static_cast<double>(input.model.num_rotors());
      const double hover = input.model.thrust.pwm(input.model.weight_N() / rotors, kFullBattery_V);
      const auto ratio = [&](double v) {
        return input.model.thrust.force_N(hover, v) * rotors / input.model.weight_N();
      };
      const double a = ratio(range.lower);
      const double b = ratio(range.upper);
      plant.thrust_scale = {plant.thrust_scale.lower * std::min(a, b),
                            plant.thrust_scale.upper * std::max(a, b)};
    } else {
      throw UsageError("--uncertain " + word +
                       ": names are mass, thrust, lag, delay, battery; mass and thrust positive");
    }
  }
  return plant;
}

Json gain_json(const UncertainGain& gain) { return {finite(gain.lower), finite(gain.upper)}; }

Json worst_json(const UncertainGain& g) {
  return {
      {"mass_kg", g.mass_kg}, {"thrust_scale", g.thrust_scale}, {"lag_s", g.lag_s}, {"delay_s", g.delay_s}};
}

/// The loop of an axis without the uncertain parameters.
AxisLoop fixed_part(const Tracking& input, int axis, Loop which) {
  stability::FlownLoop nominal = input;
  nominal.plant.thrust_scale = 1;
  AxisLoop loop = which == Loop::kSampled ? nominal.sampled(axis)->plant : *nominal.continuous(axis);
  loop.lags_s.clear();
  if (axis < 2 && input.gains.attitude_lag_s > 0) loop.lags_s.push_back(input.gains.attitude_lag_s);
  loop.delay_s = 0;
  return loop;
}

std::string number_text(const Json& x) {
  return x.is_null() ? std::string("unbounded") : fmt::format("{:.8g}", x.get<double>());
}

std::string pair_text(const Json& pair) { return number_text(pair[0]) + " .. " + number_text(pair[1]); }

/// A missing upper bound proves nothing as long as the gain is finite at every point tried.
const char* status_of(const UncertainNorms& norms) {
  if (std::isinf(norms.amplitude.lower)) return "unstable";
  for (const UncertainGain* const gain : {&norms.rate, &norms.amplitude, &norms.edge, &norms.impulse}) {
    if (std::isfinite(gain->lower) && !std::isfinite(gain->upper)) return "inconclusive";
  }
  return "enclosed";
}

const char* end_name(UncertainNorms::End end) {
  return end == UncertainNorms::End::kGap      ? "gap reached"
         : end == UncertainNorms::End::kBudget ? "budget spent"
                                               : "interrupted";
}

constexpr double kUncertainGap = 0.02;

/// Progress in percent toward the requested gap or toward the end of the budget, whichever is further.
class WayToGap {
 public:
  int percent(int evaluations, int most, double gap) {
    double way = static_cast<double>(evaluations) / most;
    if (std::isfinite(gap)) {
      if (!(first_ > 0)) first_ = std::max(gap, 2 * kUncertainGap);
      way = std::max(way, std::log(first_ / gap) / std::log(first_ / kUncertainGap));
    }
    reached_ = std::clamp(static_cast<int>(100 * way), reached_, 99);
    return reached_;
  }

 private:
  double first_ = 0;
  int reached_ = 0;
};

Json uncertain_row(int axis, Channel channel, Loop loop, const UncertainNorms& norms) {
  return {{"axis", axis_name(axis)},
          {"channel", name(channel)},
          {"loop", name(loop)},
          {"status", status_of(norms)},
          {"evaluations", norms.evaluations},
          {"ended", end_name(norms.end)},
          {"rate", gain_json(norms.rate)},
          {"amplitude", gain_json(norms.amplitude)},
          {"edge", gain_json(norms.edge)},
          {"impulse", gain_json(norms.impulse)},
          {"worst_rate", worst_json(norms.rate)},
          {"worst_amplitude", worst_json(norms.amplitude)},
          {"worst_edge", worst_json(norms.edge)},
          {"worst_impulse", worst_json(norms.impulse)}};
}

/// Repeats the rows of the previous axis for an axis with an identical loop.
void repeat_rows(Json& rows, std::size_t count, int axis) {
  for (std::size_t i = 0; i < count; ++i) {
    Json row = rows[rows.size() - count];
    row["axis"] = axis_name(axis);
    rows.push_back(std::move(row));
  }
}

/// One row of --uncertain: an axis, its input, and the loop.
struct UncertainTask {
  int axis;
  Channel channel;
  Loop loop;
};

/// Computes the norms of all tasks in parallel.
std::vector<UncertainNorms> norms_of(const std::vector<UncertainTask>& tasks, const Tracking& input,
                                     const UncertainPlant& plant, const UncertainRun& run) {
  std::vector<UncertainNorms> found(tasks.size());
  const int total = static_cast<int>(tasks.size());
  std::atomic<int> percent_done{0};  // summed over the tasks
  files::parallel_for(total, run.jobs, [&](int i) {
    const UncertainTask& task = tasks[static_cast<std::size_t>(i)];
    const AxisLoop fixed = fixed_part(input, task.axis, task.loop);
    WayToGap way;
    int shown = 0;
    const auto show = [&](int percent) {
      const int all = percent_done += percent - shown;
      shown = percent;
      run.progress(all, 100 * total);
    };
    const UncertainEffort effort = {kUncertainGap, run.most_loops, [&](int evaluations, double gap) {
                                      show(way.percent(evaluations, run.most_loops, gap));
                                      return run.cancelled == nullptr || !*run.cancelled;
                                    }};
    found[static_cast<std::size_t>(i)] =
        task.loop == Loop::kSampled
            ? uncertain_norms(SampledLoop{fixed, 1 / input.gains.rate_hz, input.gains.integrator_step_s},
                              plant, task.channel, effort)
            : uncertain_norms(fixed, plant, task.channel, effort);
    show(100);
  });
  return found;
}

}  // namespace

Json uncertain_json(const Tracking& input, const std::vector<std::string>& words, const UncertainRun& run) {
  const UncertainPlant plant = intervals_of(input, words);
  const std::size_t rows_per_axis = input.gains.rate_hz > 0 ? 4 : 2;
  const auto repeats = [&](int axis) {
    return axis > 0 && input.continuous(axis - 1) &&
           same_gains_and_lags(fixed_part(input, axis, Loop::kContinuous),
                               fixed_part(input, axis - 1, Loop::kContinuous));
  };
  std::vector<UncertainTask> tasks;
  for (int axis = 0; axis < 3; ++axis) {
    if (!input.continuous(axis) || repeats(axis)) continue;
    for (const Channel channel : {Channel::kForce, Channel::kCommand}) {
      tasks.push_back({axis, channel, Loop::kContinuous});
      if (input.gains.rate_hz > 0) tasks.push_back({axis, channel, Loop::kSampled});
    }
  }
  const std::vector<UncertainNorms> found = norms_of(tasks, input, plant, run);
  Json gains = Json::array();
  std::size_t next = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (!input.continuous(axis)) continue;
    if (repeats(axis)) {
      repeat_rows(gains, rows_per_axis, axis);
      continue;
    }
    for (std::size_t i = 0; i < rows_per_axis; ++i, ++next) {
      gains.push_back(uncertain_row(axis, tasks[next].channel, tasks[next].loop, found[next]));
    }
  }
  const auto range = [](const Interval& r) { return Json{r.lower, r.upper}; };
  return {{"mass_kg", range(plant.mass_kg)},
          {"thrust_scale", range(plant.thrust_scale)},
          {"lag_s", range(plant.lag_s)},
          {"delay_s", range(plant.delay_s)},
          {"gains", std::move(gains)}};
}

void print_uncertain(const Json& uncertain) {
  const auto text = [&](const char* key) {
    return fmt::format("{:.4g} .. {:.4g}", uncertain[key][0].get<double>(), uncertain[key][1].get<double>());
  };
  fmt::print(
      "\nWorst over mass {} kg, thrust scale {}, motor lag {} s, delay {} s: reached .. not exceeded, but "
      "for rounding\n",
      text("mass_kg"), text("thrust_scale"), text("lag_s"), text("delay_s"));
  for (const Json& g : uncertain["gains"]) {
    fmt::print("  {} {:<8} {:<10} amplitude {}  impulse {}\n{:25}edge {}  rate {}\n",
               g["axis"].get<std::string>(), g["channel"].get<std::string>(), g["loop"].get<std::string>(),
               pair_text(g["amplitude"]), pair_text(g["impulse"]), "", pair_text(g["edge"]),
               pair_text(g["rate"]));
    const bool interrupted = g["ended"] == "interrupted";
    if (g["status"] == "inconclusive") {
      fmt::print("{:25}inconclusive: {} loops tried, not all of the intervals proved stable; {}\n", "",
                 g["evaluations"].get<int>(), interrupted ? "interrupted" : "narrow them, or raise --loops");
    } else if (g["status"] == "unstable") {
      fmt::print("{:25}unstable for some values of the intervals\n", "");
    } else if (g["ended"] != "gap reached") {
      fmt::print("{:25}{} after {} loops, before both ends were {:g} % apart; the bounds hold\n", "",
                 interrupted ? "interrupted" : "budget spent", g["evaluations"].get<int>(),
                 100 * kUncertainGap);
    }
  }
}

namespace {

Json enclosure_json(const Interval& x) { return {finite(x.lower), finite(x.upper)}; }

Json verified_gains_json(const VerifiedNorms& norms) {
  return {{"rate", enclosure_json(norms.rate)},
          {"amplitude", enclosure_json(norms.amplitude)},
          {"edge", enclosure_json(norms.edge)},
          {"impulse", enclosure_json(norms.impulse)}};
}

/// @param input a channel of the force error, or an estimate.
template <class Input>
void add_verified_rows(const AxisLoop& loop, const std::optional<SampledLoop>& sampled, int axis, Input input,
                       Json& rows) {
  Json row = {{"axis", axis_name(axis)}, {"channel", name(input)}, {"loop", "continuous"}};
  const std::optional<VerifiedNorms> norms = verified_norms(loop, input);
  row["status"] = norms ? "proved" : "inconclusive";
  if (norms) {
    row.update(verified_gains_json(*norms));
    if (loop.delay_s > 0) row["delay_gain"] = norms->delay_gain;
  } else {
    row["why"] = is_stable(loop)    ? "stability could not be verified in intervals"
                 : loop.delay_s > 0 ? "the loop is unstable: a shorter delay or lower gains would be needed"
                                    : "the loop is unstable";
  }
  rows.push_back(std::move(row));
  if (!sampled) return;
  row = {{"axis", axis_name(axis)}, {"channel", name(input)}, {"loop", "sampled"}};
  const std::optional<VerifiedSampledNorms> held = verified_sampled_norms(*sampled, input);
  row["status"] = held ? "proved" : "inconclusive";
  if (held) {
    row.update(verified_gains_json(held->at_samples));
    row["between_samples"] = verified_gains_json(held->all_times);
  } else {
    row["why"] = "stability could not be verified in intervals";
  }
  rows.push_back(std::move(row));
}

}  // namespace

Json verified_json(const Tracking& input) {
  Json rows = Json::array(), of_estimates = Json::array();
  std::optional<AxisLoop> last;
  for (int axis = 0; axis < 3; ++axis) {
    const std::optional<AxisLoop> loop = input.continuous(axis);
    if (!loop) continue;
    const std::optional<SampledLoop> sampled = input.sampled(axis);
    if (axis > 0 && last && same_gains_and_lags(*loop, *last)) {
      for (Json* const repeated : {&rows, &of_estimates}) repeat_rows(*repeated, sampled ? 4 : 2, axis);
      continue;
    }
    last = loop;
    for (const Channel channel : {Channel::kForce, Channel::kCommand})
      add_verified_rows(*loop, sampled, axis, channel, rows);
    for (const Estimate estimate : {Estimate::kVelocity, Estimate::kPosition})
      add_verified_rows(*loop, sampled, axis, estimate, of_estimates);
  }
  for (Json& row : of_estimates) rows.push_back(std::move(row));
  return rows;
}

void print_verified(const Json& verified) {
  fmt::print("\nVerified enclosures of the gains\n");
  for (const Json& row : verified) {
    fmt::print("  {} {:<8} {:<10} ", row["axis"].get<std::string>(), row["channel"].get<std::string>(),
               row["loop"].get<std::string>());
    if (row["status"] != "proved") {
      fmt::print("inconclusive: {}\n", row["why"].get<std::string>());
      continue;
    }
    const auto text = [&row](const char* key) {
      if (row[key][0].is_null()) return fmt::format("{} unbounded", key);
      return fmt::format("{} [{:.13g}, {:.13g}]", key, row[key][0].get<double>(), row[key][1].get<double>());
    };
    fmt::print("{}  {}\n                        {}  {}\n", text("rate"), text("amplitude"), text("edge"),
               text("impulse"));
    if (row.contains("delay_gain")) {
      fmt::print("{:24}the delay alone makes them {:.2g} % wide\n", "",
                 200 * row["delay_gain"].get<double>());
    }
  }
}

namespace {

constexpr int kTubeSamples = 20001;
constexpr double kTubeHorizon_s = 10, kTubeStep_s = kTubeHorizon_s / (kTubeSamples - 1);

/// Integral of |y| from zero to every sample, times `size`; zeros if `size` is 0.
std::vector<double> areas_of(const TransferFunction& y, double size) {
  std::vector<double> areas(kTubeSamples, 0.0);
  if (size == 0) return areas;
  const std::vector<double> response = sampled_response(y, kTubeStep_s, kTubeSamples);
  for (std::size_t k = 1; k < areas.size(); ++k)
    areas[k] = areas[k - 1] + size * (std::abs(response[k]) + std::abs(response[k - 1])) / 2 * kTubeStep_s;
  return areas;
}

/// Returns why there is no tube; nullptr if there is one.
const char* no_tube(const AxisLoop& loop, const DisturbanceSource& source, int axis) {
  const Disturbance& d = source.axis[axis];
  if (!is_stable(loop)) return "unstable";
  if (!std::isfinite(d.amplitude_N) && !std::isfinite(d.impulse_N_s))
    return "neither amplitude nor impulse is known";
  if (!std::isfinite(source.velocity_error[axis].largest() + source.position_error[axis].largest()))
    return "the amplitude of an estimate's error is not known";
  return nullptr;
}

/// Upper bound of |e(t)| at every `every`-th sample. Estimation errors enter by their amplitude; a delay would only
/// make them act later.
Json tube_of(const AxisLoop& loop, const DisturbanceSource& source, int axis, int every) {
  const Disturbance& d = source.axis[axis];
  const std::vector<double> kernel =
      sampled_response(impulse_transfer(loop, Channel::kForce), kTubeStep_s, kTubeSamples);
  const std::vector<double> velocity_m =
      areas_of(impulse_transfer(loop, Channel::kCommand),
               loop.mass_kg * loop.Kd * source.velocity_error[axis].largest());
  const std::vector<double> position_m =
      areas_of(position_error_transfer(loop), source.position_error[axis].largest());
  double area = 0;
  double peak = 0;
  double step = 0;  // response to a unit step, and its maximum so far
  double step_peak = 0;
  Json at = Json::array();
  for (int i = 0; i < kTubeSamples; ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (i > 0) area += (std::abs(kernel[k]) + std::abs(kernel[k - 1])) / 2 * kTubeStep_s;
    if (i > 0) step += (kernel[k] + kernel[k - 1]) / 2 * kTubeStep_s;
    peak = std::max(peak, std::abs(kernel[k]));
    step_peak = std::max(step_peak, std::abs(step));
    if (i % every != 0) continue;
    double bound = std::numeric_limits<double>::infinity();
    if (std::isfinite(d.amplitude_N)) bound = area * d.amplitude_N;
    if (std::isfinite(d.impulse_N_s)) {
      // Sum over all passes that have begun by now.
      const double begun = d.pass_period_s > 0 ? 1 + std::floor(i * kTubeStep_s / d.pass_period_s) : d.passes;
      bound = std::min(bound, std::min<double>(d.passes, begun) * peak * d.impulse_N_s);
    }
    if (!source.classes_contain_bias) bound += step_peak * std::abs(source.bias_N[axis]);
    at.push_back({{"t_s", i * kTubeStep_s}, {"error_m", bound + velocity_m[k] + position_m[k]}});
  }
  return at;
}

}  // namespace

Json tube_json(const Tracking& input, const DisturbanceSource& source, int count) {
  Json rows = Json::array();
  for (int axis = 0; axis < 3; ++axis) {
    const std::optional<AxisLoop> loop = input.continuous(axis);
    if (!loop) continue;
    Json row = {{"axis", axis_name(axis)}, {"channel", "force"}, {"loop", "continuous"}};
    if (const char* const why = no_tube(*loop, source, axis)) {
      row.update({{"status", "inconclusive"}, {"why", why}, {"at", Json::array()}});
    } else {
      row.update(
          {{"status", "estimate"}, {"at", tube_of(*loop, source, axis, (kTubeSamples - 1) / (count - 1))}});
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace swarmcert::analysis
