#include "analysis/commands/bound/swarm_bound.h"

#include <fmt/core.h>

#include <cmath>

namespace swarmcert::analysis {

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

void describe_motion(files::Record& record, const OwnMotion& own) {
  record.field("error_m", own.error_m, "", "m", "upper bound");
  record.field("speed_m_s", own.speed_m_s, "", "m/s", "upper bound");
  record.field("acceleration_m_s2", own.acceleration_m_s2, "", "m/s^2", "upper bound");
}

void describe_unstable(files::Record& record, const UnstableSwarm& unstable) {
  record.field("of", unstable.is_declared ? "the swarm as declared" : "one swarm of the class", "");
  record.field("signs", unstable.sign, "Of each coupling; +1 pushes the vehicles apart.");
  record.field("growth_1_s", unstable.growth_1_s, "Of the errors.", "1/s");
  record.field("simulated_s", unstable.seconds, "", "s");
  record.field("error_over_initial", unstable.largest_error, "In the simulation.");
}

struct CouplingRow {
  int on = 0, by = 0;
  std::optional<double> missing_factor;
};

}  // namespace

const char* SwarmBound::verdict() const {
  return found.small_gain.proved ? "proved" : found.is_refuted() ? "refuted" : "inconclusive";
}

void describe(files::Record& record, const SwarmBound& bound) {
  const SmallGain& gain = bound.found.small_gain;
  std::vector<CouplingRow> couplings;
  for (std::size_t i = 0; i < bound.swarm.couplings.size(); ++i) {
    const Coupling& one = bound.swarm.couplings[i];
    couplings.push_back(
        {one.on, one.by, gain.proved ? std::nullopt : std::optional(gain.missing_factor_of[i])});
  }
  record.field("verdict", bound.verdict(), "proved, refuted or inconclusive: errors stay bounded.");
  record.object_or_null(
      bound.found.unstable.has_value(), "witness", "A swarm whose errors grow; null: none was found.",
      [&bound](files::Record& r) { describe_unstable(r, bound.found.unstable.value_or(UnstableSwarm())); });
  record.constant("loop", "continuous", "");
  record.constant("axis", "z", "");
  record.field("Gamma", gain.Gamma, "Gain from every vehicle's rate of the force error to every other's.");
  record.field("spectral_radius", Interval{gain.spectral_radius_lower, gain.spectral_radius_upper},
               "Of Gamma; below 1 proves.", "", "enclosure");
  record.field("rate_N_s", gain.rate_N_s, "Rate of every vehicle's force error in the long run.", "N/s",
               "upper bound");
  record.field("error_m", gain.error_m, "Of every vehicle in the long run.", "m", "upper bound");
  record.object("of_estimates",
                "What errors of the estimates add to every vehicle's error_m, without the couplings.",
                [&bound](files::Record& r) { describe_motion(r, bound.found.of_estimates); });
  record.object("of_force", "Likewise the force error that is declared beside the couplings.",
                [&bound](files::Record& r) { describe_motion(r, bound.found.of_force); });
  record.field("missing_factor", gain.missing_factor, "By which all couplings would have to shrink.");
  record.list("couplings", couplings, "In the order of the file.",
              [](files::Record& r, const CouplingRow& row) {
                r.field("on", row.on, "Vehicle that feels the force.");
                r.field("by", row.by, "Vehicle that causes it.");
                r.field("missing_factor", row.missing_factor,
                        "By which it alone would have to shrink; 0: it does not suffice.");
              });
}

SwarmBound swarm_bound(const Tracking& input, const std::string& path, const DisturbanceSource& source) {
  SwarmBound bound;
  bound.swarm = read_coupled_swarm(path);
  if (!input.continuous(2))
    throw UsageError("Lambda or K couples the z axis to others: a swarm needs its own loop");
  OtherErrors others;
  others.velocity_error = source.velocity_error[2];
  others.position_error = source.position_error[2];
  const bool has_force = source.kind == "declared" || source.kind == "measured";
  if (has_force) others.bias_N = source.bias_N[2];
  bound.found = couple(bound.swarm, input, others, has_force ? source.axis[2] : no_force());
  refuse_unbounded(bound.found);
  return bound;
}

void print(const SwarmBound& bound) {
  const SmallGain& gain = bound.found.small_gain;
  fmt::print("\nSwarm small gain (z, continuous): rho(Gamma) <= {:.6g}: {}\n", gain.spectral_radius_upper,
             bound.verdict());
  if (gain.proved) {
    for (std::size_t i = 0; i < gain.rate_N_s.size(); ++i) {
      fmt::print("  vehicle {}: |eps'| at most {:.6g} N/s, |e| at most {:.6g} m in the long run\n", i,
                 gain.rate_N_s[i], gain.error_m[i]);
    }
    if (bound.found.of_estimates.error_m > 0) {
      fmt::print(
          "  of which {:.6g} m directly from errors of the estimates; their effect through a network is not "
          "included and belongs in cross_rate_N_s\n",
          bound.found.of_estimates.error_m);
    }
    if (bound.found.of_force.error_m > 0)
      fmt::print("  of which {:.6g} m directly from the force error not caused by the couplings\n",
                 bound.found.of_force.error_m);
    return;
  }
  if (const auto& unstable = bound.found.unstable) {
    fmt::print(
        "  {}: errors grow by {:.4g} 1/s; simulated, {:.4g} times the initial error\n",
        bound.found.is_refuted() ? "with the directions stated" : "if all forces of the class are allowed",
        unstable->growth_1_s, unstable->largest_error);
  }
  fmt::print("  all couplings times {:.4g} would do\n", gain.missing_factor);
  for (std::size_t i = 0; i < bound.swarm.couplings.size(); ++i) {
    const double factor = gain.missing_factor_of[i];
    fmt::print("  force on {} by {}: {}\n", bound.swarm.couplings[i].on, bound.swarm.couplings[i].by,
               factor > 0 ? fmt::format("alone times {:.4g} would do", factor)
                          : std::string("alone does not suffice"));
  }
}

}  // namespace swarmcert::analysis
