#include <fmt/core.h>

#include <cmath>

#include "analysis/bound_extras.h"
#include "nn/files/file_io.h"
#include "nn/files/input_error.h"
#include "nn/files/toml.h"
#include "stability/bounds/small_gain.h"
#include "stability/bounds/unstable_swarm.h"

namespace swarmcert::analysis {

using files::Json;
using namespace stability;  // NOLINT: every name below is of that library

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
