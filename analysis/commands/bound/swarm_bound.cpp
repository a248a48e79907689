#include <fmt/core.h>

#include <cmath>

#include "analysis/commands/bound/bound_extras.h"
#include "analysis/commands/bound/bound_output.h"
#include "stability/bounds/swarms/coupled_swarm.h"

namespace swarmcert::analysis {

using files::Json;
using namespace stability;  // NOLINT: every name below is of that library

namespace {

/// Rejects infinite bounds with a message, because the bound alone would not tell the user which input to add.
void refuse_unbounded(const CoupledVerdict& verdict) {
  if (!verdict.small_gain.proved) return;
  if (!std::isfinite(verdict.of_force.error_m) || !std::isfinite(verdict.of_force.acceleration_m_s2)) {
    throw UsageError(
        "--swarm needs the size of the force error not caused by the couplings, or its rate: add "
        "--amplitude E or --rate R");
  }
  for (std::size_t i = 0; i < verdict.small_gain.error_m.size(); ++i) {
    if (std::isfinite(verdict.small_gain.error_m[i]) && std::isfinite(verdict.small_gain.rate_N_s[i]))
      continue;
    throw UsageError(
        "--swarm needs the size of the errors of the estimates, or the rate of the velocity error: "
        "add --velocity-error A, or velocity_error_rate_m_s2 of --disturbance, and --position-error P");
  }
}

}  // namespace

Json swarm_json(const Tracking& input, const std::string& path, const DisturbanceSource& source) {
  const CoupledSwarm swarm = read_coupled_swarm(path);
  if (!input.continuous(2))
    throw UsageError("Lambda or K couples the z axis to others: a swarm needs its own loop");
  OtherErrors others;
  others.velocity_error = source.velocity_error[2];
  others.position_error = source.position_error[2];
  const bool has_force = source.kind == "declared" || source.kind == "measured";
  if (has_force) others.bias_N = source.bias_N[2];
  const CoupledVerdict verdict = couple(swarm, input, others, has_force ? source.axis[2] : no_force());
  refuse_unbounded(verdict);
  const SmallGain& found = verdict.small_gain;
  Json entries = Json::array();
  for (std::size_t i = 0; i < swarm.couplings.size(); ++i) {
    entries.push_back({{"on", swarm.couplings[i].on},
                       {"by", swarm.couplings[i].by},
                       {"missing_factor", found.proved ? Json() : Json(found.missing_factor_of[i])}});
  }
  const std::optional<UnstableSwarm>& unstable = verdict.unstable;
  Json witness;
  if (unstable) {
    witness = {{"of", unstable->is_declared ? "the swarm as declared" : "one swarm of the class"},
               {"signs", unstable->sign},
               {"growth_1_s", unstable->growth_1_s},
               {"simulated_s", unstable->seconds},
               {"error_over_initial", unstable->largest_error}};
  }
  const auto motion = [](const OwnMotion& own) {
    return Json{{"error_m", finite(own.error_m)},
                {"speed_m_s", finite(own.speed_m_s)},
                {"acceleration_m_s2", finite(own.acceleration_m_s2)}};
  };
  return {{"verdict", found.proved           ? "proved"
                      : verdict.is_refuted() ? "refuted"
                                             : "inconclusive"},
          {"witness", std::move(witness)},
          {"loop", "continuous"},
          {"axis", "z"},
          {"Gamma", found.Gamma},
          {"spectral_radius", {found.spectral_radius_lower, found.spectral_radius_upper}},
          {"rate_N_s", found.rate_N_s},
          {"error_m", found.error_m},
          {"of_estimates", motion(verdict.of_estimates)},
          {"of_force", motion(verdict.of_force)},
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
    const double of_estimates_m = swarm["of_estimates"]["error_m"];
    if (of_estimates_m > 0) {
      fmt::print(
          "  of which {:.6g} m directly from errors of the estimates; their effect through a network is not "
          "included and belongs in cross_rate_N_s\n",
          of_estimates_m);
    }
    const double of_force_m = swarm["of_force"]["error_m"];
    if (of_force_m > 0)
      fmt::print("  of which {:.6g} m directly from the force error not caused by the couplings\n",
                 of_force_m);
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
