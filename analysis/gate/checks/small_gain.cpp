#include <fmt/core.h>

#include <algorithm>

#include "analysis/gate/checks/checks.h"
#include "analysis/gate/evidence.h"
#include "nn/base/file_keys.h"
#include "nn/base/toml.h"
#include "stability/bounds/swarms/coupled_swarm.h"
#include "stability/bounds/tracking_bounds.h"

namespace swarmcert::gate {

void describe_small_gain_keys(files::Keys& keys) {
  keys.must<double>("min_margin", "Of the small-gain condition.");
}

Run read_small_gain(const files::TomlTable& table, Policy&) {
  const std::optional<Limit> limit = gate::limit(table, "min_margin", "", false);
  if (!limit) refuse_without_limit(table, "min_margin = 0.1");
  return [limit = *limit](Evidence& evidence, Checks& checks) {
    const stability::CoupledSwarm swarm = stability::read_coupled_swarm(evidence.release().swarm);
    const stability::FlownLoop& setup = evidence.tracking();
    const stability::CoupledVerdict verdict = couple(swarm, setup);
    const stability::SmallGain& found = verdict.small_gain;
    Check check = row("small_gain", limit);
    judge(check, limit, 1 - found.spectral_radius_upper, 1 - found.spectral_radius_lower);
    check.witness =
        fmt::format("spectral radius of the loop of bounds at most {:.6g}", found.spectral_radius_upper);
    if (verdict.unstable && check.verdict != Verdict::kPass) {
      check.witness +=
          fmt::format("; {} grows by {:.4g} 1/s in simulation",
                      verdict.unstable->is_declared ? "the swarm as declared" : "a swarm of the class",
                      verdict.unstable->growth_1_s);
    }
    checks.push_back(std::move(check));
  };
}

}  // namespace swarmcert::gate
