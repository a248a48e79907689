#include "analysis/bound_extras.h"

#include <fmt/core.h>

#include <cmath>

#include "analysis/bound_report.h"
#include "nn/files/file_io.h"
#include "nn/files/input_error.h"
#include "nn/files/toml.h"
#include "stability/bounds/small_gain.h"
#include "stability/bounds/uncertain_norms.h"
#include "stability/bounds/unstable_swarm.h"
#include "stability/bounds/verified_norms.h"

namespace swarmcert::analysis {
namespace {

using files::Json;
using namespace stability;  // NOLINT: every name below is of that library

/// "0.032:0.037"
Range range_of(const std::string& word, const std::string& text) {
  char* end = nullptr;
  Range range;
  range.from = std::strtod(text.c_str(), &end);
  const bool has_colon = end != text.c_str() && *end == ':';
  const char* second = has_colon ? end + 1 : end;
  if (has_colon) range.to = std::strtod(second, &end);
  if (!has_colon || end == second || *end != '\0' || !(range.from <= range.to) || !(range.from >= 0) ||
      !std::isfinite(range.to)) {
    throw UsageError("--uncertain " + word + ": write NAME=FROM:TO, e.g. mass=0.032:0.037");
  }
  return range;
}

Range about(double value, double share) { return {value * (1 - share), value * (1 + share)}; }

/// The vehicle's intervals; those of the battery act on the thrust.
UncertainPlant intervals_of(const Tracking& input, const std::vector<std::string>& words) {
  UncertainPlant plant = {about(input.plant.mass_kg, 0.05), about(input.plant.thrust_scale, 0.1),
                          about(input.gains.motor_lag_s, 0.2), about(input.gains.delay_s, 0.2)};
  for (const std::string& word : words) {
    if (word == "default") continue;
    const std::size_t equals = word.find('=');
    const std::string name = word.substr(0, equals);
    const Range range = range_of(word, equals == std::string::npos ? "" : word.substr(equals + 1));
    if (name == "mass" && range.from > 0) {
      plant.mass_kg = range;
    } else if (name == "thrust" && range.from > 0) {
      plant.thrust_scale = range;
    } else if (name == "lag") {
      plant.lag_s = range;
    } else if (name == "delay") {
      plant.delay_s = range;
    } else if (name == "battery" && range.from > 0) {
      // Thrust at the PWM that hovers with a full battery, without compensation.
      const double hover = input.model.thrust.pwm(input.model.weight_N() / 4, kFullBattery_V);
      const auto ratio = [&](double v) {
        return input.model.thrust.force_N(hover, v) * 4 / input.model.weight_N();
      };
      const double a = ratio(range.from);
      const double b = ratio(range.to);
      plant.thrust_scale = {plant.thrust_scale.from * std::min(a, b), plant.thrust_scale.to * std::max(a, b)};
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

/// The loop of an axis without what varies.
AxisLoop fixed_part(const Tracking& input, int axis) {
  Plant nominal = input.plant;
  nominal.thrust_scale = 1;
  AxisLoop loop = *axis_loop(input.gains, nominal, axis);
  loop.lags_s.clear();
  if (axis < 2 && input.gains.attitude_lag_s > 0) loop.lags_s.push_back(input.gains.attitude_lag_s);
  loop.delay_s = 0;
  return loop;
}

std::string pair_text(const Json& pair) {
  const auto text = [](const Json& x) {
    return x.is_null() ? std::string("unbounded") : fmt::format("{:.8g}", x.get<double>());
  };
  return text(pair[0]) + " .. " + text(pair[1]);
}

}  // namespace

Json uncertain_json(const Tracking& input, const std::vector<std::string>& words) {
  const UncertainPlant plant = intervals_of(input, words);
  Json gains = Json::array();
  for (int axis = 0; axis < 3; ++axis) {
    if (!axis_loop(input.gains, input.plant, axis)) continue;
    for (const Channel channel : {Channel::kForce, Channel::kCommand}) {
      const UncertainNorms norms = uncertain_norms(fixed_part(input, axis), plant, channel);
      gains.push_back({{"axis", axis_name(axis)},
                       {"channel", name(channel)},
                       {"loop", "continuous"},
                       {"rate", gain_json(norms.rate)},
                       {"amplitude", gain_json(norms.amplitude)},
                       {"edge", gain_json(norms.edge)},
                       {"impulse", gain_json(norms.impulse)},
                       {"worst_amplitude", worst_json(norms.amplitude)},
                       {"worst_impulse", worst_json(norms.impulse)}});
    }
  }
  const auto range = [](const Range& r) { return Json{r.from, r.to}; };
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
      "\nWorst over mass {} kg, thrust scale {}, motor lag {} s, delay {} s: reached .. never exceeded\n",
      text("mass_kg"), text("thrust_scale"), text("lag_s"), text("delay_s"));
  for (const Json& g : uncertain["gains"]) {
    fmt::print("  {} {:<8} amplitude {}  impulse {}  rate {}\n", g["axis"].get<std::string>(),
               g["channel"].get<std::string>(), pair_text(g["amplitude"]), pair_text(g["impulse"]),
               pair_text(g["rate"]));
  }
}

Json verified_json(const Tracking& input) {
  Json rows = Json::array();
  for (int axis = 0; axis < 3; ++axis) {
    const std::optional<AxisLoop> loop = axis_loop(input.gains, input.plant, axis);
    if (!loop) continue;
    for (const Channel channel : {Channel::kForce, Channel::kCommand}) {
      Json row = {{"axis", axis_name(axis)}, {"channel", name(channel)}, {"loop", "continuous"}};
      const std::optional<VerifiedNorms> norms = verified_norms(*loop, channel);
      row["status"] = norms ? "proved" : "inconclusive";
      if (norms) {
        row["rate"] = {norms->rate.lo, norms->rate.hi};
        row["amplitude"] = {norms->amplitude.lo, norms->amplitude.hi};
        row["edge"] = {norms->edge.lo, norms->edge.hi};
        row["impulse"] = {norms->impulse.lo, norms->impulse.hi};
      } else {
        row["why"] = loop->delay_s > 0 ? "a delay has no interval method here"
                     : !(loop->Ki > 0) ? "without Ki the rate gain is infinite"
                                       : "stability could not be verified in intervals";
      }
      rows.push_back(std::move(row));
    }
  }
  return rows;
}

void print_verified(const Json& verified) {
  fmt::print("\nVerified enclosures of the continuous gains\n");
  for (const Json& row : verified) {
    fmt::print("  {} {:<8} ", row["axis"].get<std::string>(), row["channel"].get<std::string>());
    if (row["status"] != "proved") {
      fmt::print("inconclusive: {}\n", row["why"].get<std::string>());
      continue;
    }
    const auto text = [&row](const char* key) {
      return fmt::format("{} [{:.13g}, {:.13g}]", key, row[key][0].get<double>(), row[key][1].get<double>());
    };
    fmt::print("{}  {}\n             {}  {}\n", text("rate"), text("amplitude"), text("edge"),
               text("impulse"));
  }
}

Json tube_json(const Tracking& input, const DisturbanceSource& source, int count) {
  Json rows = Json::array();
  constexpr int kSamples = 20001;
  constexpr double kHorizon_s = 10;
  for (int axis = 0; axis < 3; ++axis) {
    const std::optional<AxisLoop> loop = axis_loop(input.gains, input.plant, axis);
    const Disturbance& d = source.axis[axis];
    if (!loop || !is_stable(*loop) || !(std::isfinite(d.amplitude_N) || std::isfinite(d.impulse_N_s)))
      continue;
    const double step_s = kHorizon_s / (kSamples - 1);
    const std::vector<double> kernel =
        sampled_response(impulse_transfer(*loop, Channel::kForce), step_s, kSamples);
    double area = 0;
    double peak = 0;
    Json at = Json::array();
    const int every = (kSamples - 1) / (count - 1);
    for (int i = 0; i < kSamples; ++i) {
      const auto k = static_cast<std::size_t>(i);
      if (i > 0) area += (std::abs(kernel[k]) + std::abs(kernel[k - 1])) / 2 * step_s;
      peak = std::max(peak, std::abs(kernel[k]));
      if (i % every != 0) continue;
      double bound = std::numeric_limits<double>::infinity();
      if (std::isfinite(d.amplitude_N)) bound = area * d.amplitude_N;
      if (std::isfinite(d.impulse_N_s)) bound = std::min(bound, peak * d.impulse_N_s);
      at.push_back({{"t_s", i * step_s}, {"error_m", bound}});
    }
    rows.push_back({{"axis", axis_name(axis)},
                    {"channel", "force"},
                    {"loop", "continuous"},
                    {"status", "estimate"},
                    {"at", std::move(at)}});
  }
  return rows;
}

Json swarm_json(const Tracking& input, const std::string& path) {
  const std::string text = files::read_file(path);
  const auto document = files::parse_toml(text, path);
  const files::TomlTable top(document, path);
  constexpr char kSchema[] = "swarmcert/swarm/1";
  if (top.text("schema") != kSchema) {
    top.refuse("schema", files::in_quotes(top.text("schema")), "must be " + files::in_quotes(kSchema));
  }
  top.allow_only({"schema", "vehicles", "coupling"});
  const double vehicles = top.number("vehicles");
  if (!(vehicles >= 1 && vehicles <= 200) || vehicles != std::floor(vehicles)) {
    top.refuse("vehicles", fmt::format("{}", vehicles), "must be a whole number from 1 to 200");
  }
  std::vector<Coupling> couplings;
  for (const files::TomlTable& table : top.tables("coupling")) {
    table.allow_only({"on", "by", "position_N_m", "velocity_N_s_m", "speed_m_s", "acceleration_m_s2",
                      "cross_rate_N_s", "direction"});
    const auto vehicle = [&](const char* key) {
      const double value = table.number(key);
      if (!(value >= 0 && value < vehicles) || value != std::floor(value)) {
        table.refuse(key, fmt::format("{}", value),
                     fmt::format("must be a vehicle from 0 to {}", vehicles - 1));
      }
      return static_cast<int>(value);
    };
    const auto number = [&](const char* key) {
      const double value = table.has(key) ? table.number(key) : 0;
      if (value < 0) table.refuse(key, fmt::format("{}", value), "must not be negative");
      return value;
    };
    Coupling c{vehicle("on"),           vehicle("by"),
               number("position_N_m"),  number("velocity_N_s_m"),
               number("speed_m_s"),     number("acceleration_m_s2"),
               number("cross_rate_N_s")};
    if (table.has("direction")) c.direction = table.choice("direction", {"apart", "together"}) == 0 ? 1 : -1;
    if (c.on == c.by) table.refuse("by", std::to_string(c.by), "is the vehicle itself");
    couplings.push_back(c);
  }
  const std::optional<AxisLoop> loop = axis_loop(input.gains, input.plant, 2);
  if (!loop) throw UsageError("Lambda or K couples the z axis to others: a swarm needs its own loop");
  AxisLoop acting = *loop;
  if (const auto sampled = sampled_axis_loop(input.gains, input.plant, 2)) acting.Ki = effective_Ki(*sampled);
  const RateGains gains = rate_gains(acting);
  const std::vector<LoopGains> loops(static_cast<std::size_t>(vehicles),
                                     {gains.position, gains.velocity, gains.acceleration});
  const SmallGain found = small_gain(loops, couplings);
  Json entries = Json::array();
  for (std::size_t i = 0; i < couplings.size(); ++i) {
    entries.push_back({{"on", couplings[i].on},
                       {"by", couplings[i].by},
                       {"missing_factor", found.proved ? Json() : Json(found.missing_factor_of[i])}});
  }
  // Small gain is sufficient, not necessary: where it fails, an unstable instance of the class decides the matter.
  std::optional<UnstableSwarm> unstable;
  if (!found.proved) unstable = find_unstable_swarm(acting, static_cast<int>(vehicles), couplings);
  Json witness;
  if (unstable) {
    witness = {{"of", unstable->is_declared ? "the swarm as declared" : "one swarm of the class"},
               {"signs", unstable->sign},
               {"growth_1_s", unstable->growth_1_s},
               {"simulated_s", unstable->seconds},
               {"error_over_initial", unstable->largest_error}};
  }
  const bool is_refuted = unstable && unstable->is_declared;
  return {{"verdict", found.proved ? "proved"
                      : is_refuted ? "refuted"
                                   : "inconclusive"},
          {"witness", std::move(witness)},
          {"loop", "continuous"},
          {"axis", "z"},
          {"Gamma", found.Gamma},
          {"spectral_radius", {found.spectral_radius_lower, found.spectral_radius_upper}},
          {"rate_N_s", found.rate_N_s},
          {"error_m", found.error_m},
          {"missing_factor", found.missing_factor},
          {"couplings", std::move(entries)}};
}

void print_swarm(const Json& swarm) {
  fmt::print("\nSwarm small gain (z, continuous): rho(Gamma) <= {:.6g}: {}\n",
             swarm["spectral_radius"][1].get<double>(), swarm["verdict"].get<std::string>());
  if (swarm["verdict"] == "proved") {
    for (std::size_t i = 0; i < swarm["rate_N_s"].size(); ++i) {
      fmt::print("  vehicle {}: |eps'| at most {:.6g} N/s, |e| at most {:.6g} m in the long run\n", i,
                 swarm["rate_N_s"][i].get<double>(), swarm["error_m"][i].get<double>());
    }
    return;
  }
  if (!swarm["witness"].is_null()) {
    fmt::print("  {}: errors grow by {:.4g} 1/s; simulated, {:.4g} times the initial error\n",
               swarm["verdict"] == "refuted" ? "with the directions stated"
                                             : "if all forces of the class are allowed",
               swarm["witness"]["growth_1_s"].get<double>(),
               swarm["witness"]["error_over_initial"].get<double>());
  }
  fmt::print("  all couplings times {:.4g} would do\n", swarm["missing_factor"].get<double>());
  for (const Json& c : swarm["couplings"]) {
    const double factor = c["missing_factor"].get<double>();
    fmt::print("  force on {} by {}: {}\n", c["on"].get<int>(), c["by"].get<int>(),
               factor > 0 ? fmt::format("alone times {:.4g} would do", factor)
                          : std::string("alone does not suffice"));
  }
}

}  // namespace swarmcert::analysis
