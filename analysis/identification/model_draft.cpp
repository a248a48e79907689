#include "analysis/identification/model_draft.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "analysis/logs/flight_story.h"
#include "analysis/logs/read_log.h"
#include "nn/base/input_error.h"

namespace swarmcert::identification {
namespace {

constexpr double kDraftBlock_s = 2, kDraftQuantile90 = 1.645;

/// Mean of several estimates with the interval that their scatter gives.
struct Estimate {
  double value = 0, lower = 0, upper = 0;
  std::size_t count = 0;
};

Estimate estimate(const std::vector<double>& values) {
  Estimate result;
  result.count = values.size();
  if (values.empty()) return result;
  for (const double value : values) result.value += value / static_cast<double>(values.size());
  double squares = 0;
  for (const double value : values) squares += (value - result.value) * (value - result.value);
  const auto n = static_cast<double>(values.size());
  const double half = values.size() > 1 ? kDraftQuantile90 * std::sqrt(squares / (n - 1) / n) : 0;
  result.lower = result.value - half;
  result.upper = result.value + half;
  return result;
}

/// What one log says.
struct LogFit {
  std::string path;
  logs::ThrustSource thrust = logs::ThrustSource::kNone;
  std::vector<double> mass_kg;  ///< thrust over specific force along the thrust axis, per block of 2 s
  double hover_command = 0, delay_s = NAN;
};

/// Thrust over specific force along the thrust axis, means over blocks in the air: the mass, if the thrust is right.
LogFit fit(const logs::Log& log, const stability::Model& base) {
  LogFit result;
  result.path = log.path;
  result.thrust = log.signals.thrust;
  result.hover_command = log.hover_command;
  for (const logs::SignalDelay& delay : log.delays) {
    if (delay.signal == "specific_force" && delay.against == "thrust") result.delay_s = delay.delay_s;
  }
  const std::vector<char> air = logs::airborne(log);
  double thrust_N = 0, load = 0, start_s = -INFINITY;
  const auto close = [&] {
    if (load > 0) result.mass_kg.push_back(thrust_N / load);
    thrust_N = load = 0;
  };
  for (std::size_t i = 0; i < log.samples.size(); ++i) {
    if (air[i] == 0) continue;
    const logs::Sample& s = log.samples[i];
    const auto R = logs::rotation(s);
    if (R[2][2] < 0.7) continue;
    if (1e-6 * s.time_us - start_s > kDraftBlock_s) {
      close();
      start_s = 1e-6 * s.time_us;
    }
    double now_N = s.given_thrust;
    if (log.signals.thrust == logs::ThrustSource::kDuty) {
      now_N = 0;
      for (const double duty : s.duty) now_N += base.thrust.force_N(duty, s.battery_V);
    }
    thrust_N += now_N;
    load += s.specific_force_m_s2[2] / R[2][2];
  }
  close();
  // Takeoff and landing stand in the first and the last block.
  if (result.mass_kg.size() > 4) {
    result.mass_kg.erase(result.mass_kg.begin());
    result.mass_kg.pop_back();
  }
  return result;
}

double middle(std::vector<double> values) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Bodies of one shape and density: lengths grow with the third root of the mass, inertia with mass times length squared.
void scale_body(const stability::Model& base, ModelDraft& draft) {
  stability::Model& model = draft.model;
  const double mass = model.mass_kg / base.mass_kg, length = std::cbrt(mass);
  model.arm_m = base.arm_m * length;
  model.torque_per_thrust_m = base.torque_per_thrust_m * length;
  for (std::size_t k = 0; k < 3; ++k) model.inertia_kg_m2[k] = base.inertia_kg_m2[k] * mass * length * length;
  const std::string source =
      fmt::format("assumption: {} of {:g} kg, scaled to the mass", base.kind, base.mass_kg);
  draft.parameters.push_back({"arm_m", model.arm_m, false, 0, 0, source});
  draft.parameters.push_back({"torque_per_thrust_m", model.torque_per_thrust_m, false, 0, 0, source});
  const char* const kAxes[] = {"x", "y", "z"};
  for (std::size_t k = 0; k < 3; ++k)
    draft.parameters.push_back(
        {fmt::format("inertia_{}_kg_m2", kAxes[k]), model.inertia_kg_m2[k], false, 0, 0, source});
}

/// Motors whose command at hover is known: force proportional to the command, in a model of four rotors.
void set_linear_thrust(double hover_command, ModelDraft& draft) {
  stability::ThrustMap& map = draft.model.thrust;
  map = {};
  map.c10 = draft.model.weight_N() / 4 / hover_command / stability::kGramForce_N;
  draft.parameters.push_back({"thrust.c10", map.c10, false, 0, 0,
                              "fit: force proportional to the command, the weight at the hover command"});
}

std::vector<LogFit> fits_of(const residuals::FoundFlights& found, const logs::SignalMap& map,
                            const stability::Model& base, ModelDraft& draft) {
  std::vector<LogFit> fits;
  for (const residuals::FlightFiles& flight : found.flights) {
    for (const auto& [vehicle, path] : flight.logs) {
      try {
        const logs::Log log = logs::read_log(path, map);
        const logs::FlightStory story = logs::tell(log);
        if (!story.no_flight.empty()) {
          draft.problems.push_back(path + ": no flight: " + story.no_flight);
        } else if (!log.signals.force) {
          draft.problems.push_back(path + ": the log lacks " + log.signals.force_lacks);
        } else {
          fits.push_back(fit(log, base));
        }
      } catch (const files::InputError& error) {
        draft.problems.emplace_back(error.what());
      }
    }
  }
  return fits;
}

}  // namespace

ModelDraft draft_model(const residuals::FoundFlights& found, const logs::SignalMap& map,
                       const std::map<std::string, double>& masses_kg, double mass_kg,
                       const stability::Model& base) {
  ModelDraft draft;
  draft.model = base;
  draft.model.path.clear();
  draft.model.kind = "draft";
  draft.model.effects.clear();
  draft.model.ladder.clear();
  const std::vector<LogFit> fits = fits_of(found, map, base, draft);
  std::vector<double> carried_kg, ratios, delays_s, hover;
  for (const LogFit& log : fits) {
    if (std::isfinite(log.delay_s) && log.delay_s >= 0) delays_s.push_back(log.delay_s);
    if (log.thrust == logs::ThrustSource::kHoverMultiple) {
      hover.push_back(log.hover_command);
      continue;
    }
    if (log.mass_kg.empty()) continue;
    const double of_log_kg = middle(log.mass_kg);
    const auto known = masses_kg.find(log.path);
    const double true_kg = known != masses_kg.end() ? known->second : mass_kg;
    if (true_kg > 0) ratios.push_back(true_kg / of_log_kg);
    // Of one flight only, its blocks give the scatter.
    if (fits.size() == 1)
      carried_kg = log.mass_kg;
    else
      carried_kg.push_back(of_log_kg);
  }
  draft.flights = fits.size();
  if (carried_kg.empty() && hover.empty()) {
    throw files::InputError(
        {found.flights[0].logs[0].second, "", "thrust", "", "no log here has a force and a flight",
         draft.problems.empty() ? "'swarmcert inspect' says what a log lacks" : draft.problems[0]});
  }
  const Estimate carried = estimate(carried_kg), ratio = estimate(ratios);
  stability::Model& model = draft.model;
  if (mass_kg > 0 || ratio.count > 0) {
    double sum = 0;
    for (const auto& [path, kg] : masses_kg) sum += kg;
    model.mass_kg = mass_kg > 0 ? mass_kg : sum / static_cast<double>(masses_kg.size());
    draft.parameters.push_back({"mass_kg", model.mass_kg, false, 0, 0,
                                mass_kg > 0 ? "stated (--mass)" : "flights.toml, mean of the logs"});
  } else if (carried.count > 0) {
    model.mass_kg = carried.value;
    draft.parameters.push_back(
        {"mass_kg", carried.value, true, carried.lower, carried.upper,
         "fit: what the thrust carries, if its scale is right; mass, payload and thrust scale "
         "cannot be told apart"});
  } else {
    model.mass_kg = 1;
    draft.parameters.push_back(
        {"mass_kg", 1, false, 0, 0, "assumption: no log shows it; state it with --mass"});
  }
  scale_body(base, draft);
  if (!hover.empty()) {
    const Estimate command = estimate(hover);
    draft.parameters.push_back({"hover_command", command.value, hover.size() > 1, command.lower,
                                command.upper, "fit: mean motor command that carries the weight"});
    set_linear_thrust(command.value, draft);
  } else {
    const char* const kKeys[] = {"c00", "c10", "c01", "c20", "c11"};
    const double values[] = {base.thrust.c00, base.thrust.c10, base.thrust.c01, base.thrust.c20,
                             base.thrust.c11};
    for (std::size_t k = 0; k < 5; ++k)
      draft.parameters.push_back({fmt::format("thrust.{}", kKeys[k]), values[k], false, 0, 0,
                                  "assumption: load cell, " + base.kind});
  }
  if (ratio.count > 0) {
    stability::EffectSpec effect;
    effect.name = "thrust_ratio";
    // The effect's parameter is the excess over one.
    effect.parameters["ratio"] = std::clamp(ratio.value - 1, -0.7, 0.7);
    effect.fit.interval["ratio"] = {ratio.lower - 1, ratio.upper - 1};
    effect.fit.note = "drafted from hovering thrust";
    model.effects.push_back(effect);
    draft.parameters.push_back({"thrust_ratio.ratio", ratio.value, ratio.count > 1, ratio.lower, ratio.upper,
                                "fit: mass over what the thrust carries"});
  }
  if (!delays_s.empty()) {
    const Estimate delay = estimate(delays_s);
    draft.parameters.push_back({"thrust_delay_s", delay.value, delays_s.size() > 1, delay.lower, delay.upper,
                                "fit: correlation of thrust and acceleration; 'add motor_lag' splits it"});
  }
  return draft;
}

}  // namespace swarmcert::identification
