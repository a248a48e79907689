#include "analysis/identification/model_draft.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "analysis/identification/draft_geometry.h"
#include "analysis/identification/rotor_response.h"
#include "analysis/identification/thrust_curve.h"
#include "analysis/logs/flight_story.h"
#include "analysis/logs/plausibility.h"
#include "analysis/logs/read_log.h"
#include "nn/base/input_error.h"
#include "nn/base/median.h"
#include "stability/effects/registry.h"

namespace swarmcert::identification {
namespace {

constexpr double kDraftBlock_s = 2, kDraftQuantile90 = 1.645;

/// Mean of several estimates, with an interval from their scatter.
struct DraftEstimate {
  double value = 0, lower = 0, upper = 0;
  std::size_t count = 0;
};

DraftEstimate estimate(const std::vector<double>& values) {
  DraftEstimate result;
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

/// Estimates from one log.
struct LogFit {
  std::string path;
  logs::ThrustSource thrust = logs::ThrustSource::kNone;
  std::vector<double> mass_kg;  ///< thrust over specific force along the thrust axis, per block of 2 s
  double hover_command = 0, delay_s = NAN;
  std::size_t motors = 0;  ///< number of motors with commands; 0: the log has duties or a force
  int motor_power = 1;
  double least_V = INFINITY, most_V = 0;  ///< of the battery in flight
  std::map<std::string, double> parameters;
  std::optional<RotorResponse> response;  ///< if the log has motor commands and rates
  LoadBlocks loads;                       ///< empty without motor commands
};

/// Fits thrust over specific force along the thrust axis, in means over blocks: the mass, if the thrust is right.
LogFit fit(const logs::Log& log, const stability::Model& base) {
  LogFit result;
  result.path = log.path;
  result.thrust = log.signals.thrust;
  result.hover_command = log.hover_command;
  result.motors = static_cast<std::size_t>(log.signals.motor_commands);
  result.motor_power = log.motor_power;
  result.parameters = log.parameters;
  for (const logs::SignalDelay& delay : log.delays) {
    if (delay.signal == "specific_force" && delay.against == "thrust") result.delay_s = delay.delay_s;
  }
  const std::vector<char> air = logs::airborne(log);
  if (result.motors > 0 && log.signals.rates && log.hover_command > 0)
    result.response = rotor_response(log, air);
  if (result.motors > 0 && log.hover_command > 0) result.loads = load_blocks(log, air);
  double thrust_N = 0, load = 0, start_s = -INFINITY;
  const auto close = [&] {
    if (load > 0) result.mass_kg.push_back(thrust_N / load);
    thrust_N = load = 0;
  };
  for (std::size_t i = 0; i < log.samples.size(); ++i) {
    if (air[i] == 0) continue;
    const logs::Sample& s = log.samples[i];
    if (s.battery_V > 0) {
      result.least_V = std::min(result.least_V, s.battery_V);
      result.most_V = std::max(result.most_V, s.battery_V);
    }
    const auto R = s.attitude.rotation();
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
  // The first and the last block contain takeoff and landing.
  if (result.mass_kg.size() > 4) {
    result.mass_kg.erase(result.mass_kg.begin());
    result.mass_kg.pop_back();
  }
  return result;
}

/// Scales for bodies of the same shape and density: lengths with the cube root of the mass, inertia with mass times
/// length squared.
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

/// Replaces the assumed arm by that of the given rotors; inertia scales with its square.
void use_stated_arm(ModelDraft& draft) {
  stability::Model& model = draft.model;
  double arm_m = 0;
  for (const stability::RotorPlace& rotor : model.rotors)
    arm_m += std::hypot(rotor.x_m, rotor.y_m) / static_cast<double>(model.rotors.size());
  const double ratio = arm_m / model.arm_m;
  for (double& inertia : model.inertia_kg_m2) inertia *= ratio * ratio;
  model.arm_m = arm_m;
  auto& parameters = draft.parameters;
  parameters.erase(std::remove_if(parameters.begin(), parameters.end(),
                                  [](const DraftedParameter& p) { return p.name == "arm_m"; }),
                   parameters.end());
  for (DraftedParameter& p : parameters) {
    if (p.name.rfind("inertia_", 0) != 0) continue;
    p.value *= ratio * ratio;
    p.source += " and the stated rotors";
  }
}

/// Returns the places that the flights show; none if no flight shows them, or if two disagree.
std::vector<stability::RotorPlace> places_seen(const std::vector<LogFit>& fits, double arm_m) {
  std::vector<stability::RotorPlace> seen;
  for (const LogFit& log : fits) {
    const std::vector<stability::RotorPlace> places =
        log.response ? places_of(*log.response, arm_m) : std::vector<stability::RotorPlace>{};
    const auto is_same = [](const stability::RotorPlace& a, const stability::RotorPlace& b) {
      return a.x_m == b.x_m && a.y_m == b.y_m && a.counterclockwise == b.counterclockwise;
    };
    if (places.empty()) continue;
    if (!seen.empty() && !std::equal(seen.begin(), seen.end(), places.begin(), places.end(), is_same))
      return {};
    seen = places;
  }
  return seen;
}

/// Sets the force of a rotor: the weight at the hover command, or the polynomial that the flights show.
void draft_thrust(const LogFit& log, double hover_command, const std::vector<LogFit>& fits,
                  ModelDraft& draft) {
  const double each_N = draft.model.weight_N() / static_cast<double>(log.motors);
  std::vector<LoadBlocks> loads;
  for (const LogFit& one : fits) {
    if (one.motors == log.motors) loads.push_back(one.loads);
  }
  const ThrustCurve found = thrust_curve(loads, log.motor_power);
  std::array<double, 3> curve_N{};
  const auto power = static_cast<std::size_t>(log.motor_power);
  curve_N[power] = each_N / std::pow(hover_command, log.motor_power);
  std::string source = fmt::format("fit: force proportional to {}, the weight at the hover command",
                                   power == 2 ? "the square of the command" : "the command");
  if (found.is_found()) {
    for (std::size_t k = 0; k < 3; ++k) curve_N[k] = each_N * found.shares[static_cast<Eigen::Index>(k)];
    source = "fit: polynomial of the command";
  }
  set_thrust_curve(curve_N, draft.model);
  for (std::size_t k = 0; k < 3; ++k) {
    if (curve_N[k] == 0) continue;
    draft.parameters.push_back(
        {fmt::format("thrust_curve.force_N[{}]", k), curve_N[k], false, 0, 0, source + "; " + found.why});
  }
}

/// Sets the rotors and their thrust from logs with motor commands: the weight at the hover command.
void set_motors(const LogFit& log, double hover_command, const std::vector<LogFit>& fits, ModelDraft& draft) {
  stability::Model& model = draft.model;
  DraftedGeometry geometry = geometry_of(log.parameters, log.motors, model.arm_m);
  const bool is_stated = geometry.torque_per_thrust_m > 0;
  const std::vector<stability::RotorPlace> seen = places_seen(fits, model.arm_m);
  if (!is_stated && seen.size() == log.motors) {
    geometry.rotors = seen;
    geometry.source = "fit: which motor turns the vehicle which way; the distance is that of arm_m";
  }
  model.rotors = geometry.rotors;
  const auto add = [&draft](const std::string& name, double value, const std::string& source) {
    draft.parameters.push_back({name, value, false, 0, 0, source});
  };
  for (std::size_t k = 0; k < model.rotors.size(); ++k) {
    const stability::RotorPlace& rotor = model.rotors[k];
    const std::string name = fmt::format("rotors[{}].", k + 1);
    add(name + "x_m", rotor.x_m, geometry.source);
    add(name + "y_m", rotor.y_m, geometry.source);
    add(name + "spin", rotor.counterclockwise ? 1 : -1, geometry.source + "; 1: ccw, -1: cw");
  }
  if (is_stated) {
    use_stated_arm(draft);
    model.torque_per_thrust_m = geometry.torque_per_thrust_m;
    for (DraftedParameter& p : draft.parameters) {
      if (p.name == "torque_per_thrust_m")
        p = {p.name, model.torque_per_thrust_m, false, 0, 0, "log parameters CA_ROTOR*_KM"};
    }
  }
  draft_thrust(log, hover_command, fits, draft);
  for (const char* stated : {"MPC_THR_HOVER", "MOT_THST_HOVER"}) {
    const auto found = log.parameters.find(stated);
    if (found != log.parameters.end())
      add(stated, found->second, "log parameter, for comparison with hover_command");
  }
}

/// Sets the range of a multi-cell battery: a fifth below the measured voltages and a tenth above.
void set_battery_range(const std::vector<LogFit>& fits, ModelDraft& draft) {
  double least_V = INFINITY, most_V = 0;
  for (const LogFit& log : fits) {
    least_V = std::min(least_V, log.least_V);
    most_V = std::max(most_V, log.most_V);
  }
  auto& range = draft.model.battery_range_V;
  if (!(most_V > 0) || (least_V >= range.lower && most_V <= range.upper)) return;
  range = {0.8 * least_V, 1.1 * most_V};
  const std::string source = "log: measured range, extended by a fifth below and a tenth above";
  draft.parameters.push_back({"battery_range_V.least", range.lower, false, 0, 0, source});
  draft.parameters.push_back({"battery_range_V.most", range.upper, false, 0, 0, source});
}

/// Returns why a log is damaged or implausible; empty if it is neither.
std::string why_not_trusted(const logs::Log& log) {
  if (!logs::is_sound(log.health)) return "damaged: " + logs::findings(log.health).front();
  for (const logs::Doubt& doubt : logs::doubts_of(log)) {
    if (doubt.refuses_force) return "implausible: " + doubt.words;
  }
  return "";
}

std::vector<LogFit> fits_of(const residuals::FoundFlights& found, const logs::SignalMap& map,
                            const stability::Model& base, bool keep, ModelDraft& draft) {
  std::vector<LogFit> fits;
  for (const residuals::FlightFiles& flight : found.flights) {
    for (const auto& [vehicle, path] : flight.logs) {
      try {
        const logs::Log log = logs::read_log(path, map);
        const logs::FlightStory story = logs::tell(log);
        const std::string doubt = keep ? "" : why_not_trusted(log);
        if (!story.no_flight.empty()) {
          draft.problems.push_back(path + ": no flight: " + story.no_flight);
        } else if (!log.signals.force) {
          draft.problems.push_back(path + ": the log lacks " + log.signals.force_lacks);
        } else if (!doubt.empty()) {
          draft.problems.push_back(path + ": " + doubt + " (--keep takes it)");
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
                       const std::map<std::string, double>& masses_kg, double mass_kg, bool keep,
                       const stability::Model& base) {
  ModelDraft draft;
  draft.model = base;
  draft.model.path.clear();
  draft.model.kind = "draft";
  draft.model.effects.clear();
  draft.model.ladder.clear();
  const std::vector<LogFit> fits = fits_of(found, map, base, keep, draft);
  const LogFit* motors = nullptr;  // the first log with commands instead of forces
  std::vector<double> carried_kg, ratios, delays_s, hover;
  for (const LogFit& log : fits) {
    if (std::isfinite(log.delay_s) && log.delay_s >= 0) delays_s.push_back(log.delay_s);
    if (log.thrust == logs::ThrustSource::kHoverMultiple) {
      if (!motors) motors = &log;
      if (log.motors == motors->motors && log.motor_power == motors->motor_power)
        hover.push_back(log.hover_command);
      else
        draft.problems.push_back(fmt::format(
            "{}: {} motors whose thrust grows with power {} of the command; {} "
            "has {} and {}",
            log.path, log.motors, log.motor_power, motors->path, motors->motors, motors->motor_power));
      continue;
    }
    if (log.mass_kg.empty()) continue;
    const double of_log_kg = upper_median(log.mass_kg);
    const auto known = masses_kg.find(log.path);
    const double true_kg = known != masses_kg.end() ? known->second : mass_kg;
    if (true_kg > 0) ratios.push_back(true_kg / of_log_kg);
    // With a single flight, its blocks give the scatter.
    if (fits.size() == 1)
      carried_kg = log.mass_kg;
    else
      carried_kg.push_back(of_log_kg);
  }
  draft.flights = fits.size();
  if (carried_kg.empty() && hover.empty()) {
    throw files::InputError(
        {found.flights[0].logs[0].second, "", "thrust", "", "no log here has a force and a flight",
         draft.problems.empty() ? "'swarmcert inspect' reports what a log lacks" : draft.problems[0]});
  }
  const DraftEstimate carried = estimate(carried_kg), ratio = estimate(ratios);
  stability::Model& model = draft.model;
  if (mass_kg > 0 || ratio.count > 0) {
    double sum = 0;
    for (const auto& [path, kg] : masses_kg) sum += kg;
    model.mass_kg = mass_kg > 0 ? mass_kg : sum / static_cast<double>(masses_kg.size());
    draft.parameters.push_back({"mass_kg", model.mass_kg, false, 0, 0,
                                mass_kg > 0 ? "stated (--mass)" : "flights.toml, mean of the logs"});
  } else if (carried.count > 0) {
    model.mass_kg = carried.value;
    draft.parameters.push_back({"mass_kg", carried.value, true, carried.lower, carried.upper,
                                "fit: mass carried by the thrust, if its scale is right; mass, payload and "
                                "thrust scale cannot be distinguished"});
  } else {
    model.mass_kg = 1;
    draft.parameters.push_back(
        {"mass_kg", 1, false, 0, 0, "assumption: no log shows it; state it with --mass"});
  }
  scale_body(base, draft);
  if (!hover.empty()) {
    const DraftEstimate command = estimate(hover);
    draft.parameters.push_back({"hover_command", command.value, hover.size() > 1, command.lower,
                                command.upper, "fit: mean motor command that carries the weight"});
    if (motors->motors > 0) {
      set_motors(*motors, command.value, fits, draft);
    } else {
      // The log has rotor speeds or a collective command in any unit, but no commands of 0 .. 1 for each motor.
      const double each_N = draft.model.weight_N() / 4;
      const bool is_share = command.value < 1;
      set_thrust_curve({0, each_N / (is_share ? command.value : 0.5), 0}, draft.model);
      draft.parameters.push_back({"thrust_curve.force_N[1]", (*draft.model.thrust_curve_N)[1], false, 0, 0,
                                  is_share
                                      ? "assumption: four rotors, force proportional to the command"
                                      : "assumption: four rotors with a total thrust of twice the weight"});
    }
  } else {
    const char* const kKeys[] = {"c00", "c10", "c01", "c20", "c11"};
    const double values[] = {base.thrust.c00, base.thrust.c10, base.thrust.c01, base.thrust.c20,
                             base.thrust.c11};
    for (std::size_t k = 0; k < 5; ++k)
      draft.parameters.push_back({fmt::format("thrust.{}", kKeys[k]), values[k], false, 0, 0,
                                  "assumption: load cell, " + base.kind});
  }
  set_battery_range(fits, draft);
  if (ratio.count > 0) {
    stability::EffectSpec effect;
    effect.name = stability::plain_effect(stability::Family::kThrustScale);
    const stability::Parameter& bounds = stability::effect_info(effect.name).linear[0];
    // The effect's parameter is the excess over one.
    effect.parameters["ratio"] = std::clamp(ratio.value - 1, bounds.lower, bounds.upper);
    effect.fit.interval["ratio"] = {ratio.lower - 1, ratio.upper - 1};
    effect.fit.note = "drafted from hovering thrust";
    model.effects.push_back(effect);
    draft.parameters.push_back({effect.name + ".ratio", ratio.value, ratio.count > 1, ratio.lower,
                                ratio.upper, "fit: mass divided by the mass carried by the thrust"});
  }
  if (!delays_s.empty()) {
    const DraftEstimate delay = estimate(delays_s);
    draft.parameters.push_back({"thrust_delay_s", delay.value, delays_s.size() > 1, delay.lower, delay.upper,
                                "fit: correlation of thrust and acceleration; 'add motor_lag' splits it"});
  }
  return draft;
}

}  // namespace swarmcert::identification
