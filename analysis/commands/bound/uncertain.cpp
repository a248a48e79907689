#include "analysis/commands/bound/uncertain.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "analysis/tracking/tube/error_loops.h"
#include "analysis/tracking/usual_uncertainty.h"
#include "nn/base/parallel.h"

namespace swarmcert::analysis {
namespace {

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

/// Computes the norms of all rows in parallel.
void compute(const Tracking& input, const UncertainPlant& plant, const UncertainRun& run,
             std::vector<UncertainRow>& rows) {
  const int total = static_cast<int>(rows.size());
  std::atomic<int> percent_done{0};  // summed over the tasks
  files::parallel_for(total, run.jobs, [&](int i) {
    UncertainRow& task = rows[static_cast<std::size_t>(i)];
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
    task.norms =
        task.loop == Loop::kSampled
            ? uncertain_norms(SampledLoop{fixed, 1 / input.gains.rate_hz, input.gains.integrator_step_s},
                              plant, task.channel, effort)
            : uncertain_norms(fixed, plant, task.channel, effort);
    show(100);
  });
}

void describe_worst(files::Record& record, const UncertainGain& gain) {
  record.field("mass_kg", gain.mass_kg, "", "kg");
  record.field("thrust_scale", gain.thrust_scale, "");
  record.field("lag_s", gain.lag_s, "", "s");
  record.field("delay_s", gain.delay_s, "", "s");
}

void describe_uncertain_row(files::Record& record, const UncertainRow& row) {
  struct Named {
    const char *name, *worst;
    const UncertainGain& gain;
  };
  const UncertainNorms& norms = row.norms;
  const Named all[] = {{"rate", "worst_rate", norms.rate},
                       {"amplitude", "worst_amplitude", norms.amplitude},
                       {"edge", "worst_edge", norms.edge},
                       {"impulse", "worst_impulse", norms.impulse}};
  record.field("axis", axis_name(row.axis), "");
  record.field("channel", name(row.channel), "force or command: where the disturbance enters.");
  record.field("loop", name(row.loop), "continuous or sampled.");
  record.field("status", status_of(norms), "enclosed, unstable for some values, or inconclusive.");
  record.field("evaluations", norms.evaluations, "Loops that were tried.");
  record.field("ended", end_name(norms.end), "gap reached, budget spent or interrupted.");
  for (const Named& one : all)
    record.field(one.name, Interval{one.gain.lower, one.gain.upper},
                 "Reached, and not exceeded but for rounding; null: not bounded.");
  for (const Named& one : all)
    record.object(one.worst, "Where the lower end is reached.",
                  [&one](files::Record& r) { describe_worst(r, one.gain); });
}

std::string text(const UncertainGain& gain) {
  const auto end = [](double x) {
    return std::isfinite(x) ? fmt::format("{:.8g}", x) : std::string("unbounded");
  };
  return end(gain.lower) + " .. " + end(gain.upper);
}

}  // namespace

void describe(files::Record& record, const Uncertain& uncertain) {
  record.field("mass_kg", uncertain.plant.mass_kg, "Interval over which the gains hold.", "kg");
  record.field("thrust_scale", uncertain.plant.thrust_scale, "Likewise: actual over commanded force.");
  record.field("lag_s", uncertain.plant.lag_s, "Likewise, of the motors.", "s");
  record.field("delay_s", uncertain.plant.delay_s, "Likewise.", "s");
  record.list("gains", uncertain.gains, "Per axis, channel and loop.", describe_uncertain_row);
}

Uncertain uncertain_gains(const Tracking& input, const std::vector<std::string>& words,
                          const UncertainRun& run) {
  Uncertain result;
  result.plant = intervals_of(input, words);
  const auto repeats = [&](int axis) {
    return axis > 0 && input.continuous(axis - 1) &&
           same_gains_and_lags(fixed_part(input, axis, Loop::kContinuous),
                               fixed_part(input, axis - 1, Loop::kContinuous));
  };
  std::vector<UncertainRow> rows;
  for (int axis = 0; axis < 3; ++axis) {
    if (!input.continuous(axis) || repeats(axis)) continue;
    for (const Channel channel : {Channel::kForce, Channel::kCommand}) {
      rows.push_back({axis, channel, Loop::kContinuous, {}});
      if (input.is_sampled()) rows.push_back({axis, channel, Loop::kSampled, {}});
    }
  }
  compute(input, result.plant, run, rows);
  const std::size_t rows_per_axis = input.is_sampled() ? 4 : 2;
  std::size_t next = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (!input.continuous(axis)) continue;
    if (repeats(axis)) next -= rows_per_axis;
    for (std::size_t i = 0; i < rows_per_axis; ++i, ++next) {
      result.gains.push_back(rows[next]);
      result.gains.back().axis = axis;
    }
  }
  return result;
}

void print(const Uncertain& uncertain) {
  const auto range = [](const Interval& x) { return fmt::format("{:.4g} .. {:.4g}", x.lower, x.upper); };
  const UncertainPlant& plant = uncertain.plant;
  fmt::print(
      "\nWorst over mass {} kg, thrust scale {}, motor lag {} s, delay {} s: reached .. not exceeded, but "
      "for rounding\n",
      range(plant.mass_kg), range(plant.thrust_scale), range(plant.lag_s), range(plant.delay_s));
  for (const UncertainRow& row : uncertain.gains) {
    const UncertainNorms& norms = row.norms;
    fmt::print("  {} {:<8} {:<10} amplitude {}  impulse {}\n{:25}edge {}  rate {}\n", axis_name(row.axis),
               name(row.channel), name(row.loop), text(norms.amplitude), text(norms.impulse), "",
               text(norms.edge), text(norms.rate));
    const std::string status = status_of(norms);
    const bool interrupted = norms.end == UncertainNorms::End::kStopped;
    if (status == "inconclusive") {
      fmt::print("{:25}inconclusive: {} loops tried, not all of the intervals proved stable; {}\n", "",
                 norms.evaluations, interrupted ? "interrupted" : "narrow them, or raise --loops");
    } else if (status == "unstable") {
      fmt::print("{:25}unstable for some values of the intervals\n", "");
    } else if (norms.end != UncertainNorms::End::kGap) {
      fmt::print("{:25}{} after {} loops, before both ends were {:g} % apart; the bounds hold\n", "",
                 interrupted ? "interrupted" : "budget spent", norms.evaluations, 100 * kUncertainGap);
    }
  }
}

}  // namespace swarmcert::analysis
