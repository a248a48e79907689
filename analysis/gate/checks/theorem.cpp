#include <fmt/ranges.h>

#include <algorithm>

#include "analysis/gate/checks/checks.h"
#include "analysis/gate/checks/disturbance.h"
#include "nn/base/file_keys.h"
#include "nn/base/toml.h"
#include "stability/bounds/flown_loop.h"

namespace swarmcert::gate {

void describe_theorem_keys(files::Keys& keys) {
  describe_disturbance(keys);
  keys.may<double>("max_ball_m", "Of the theorem's ball; absent: only its hypotheses are checked.", "m");
}

Run read_theorem(const files::TomlTable& table, Policy& policy) {
  const DisturbanceTable declared = read_disturbance(table);
  const std::optional<Limit> ball = limit(table, "max_ball_m", "m");
  if (ball && !declared.is_declared() && policy.release.flights.empty())
    table.refuse("max_ball_m", "", "needs a force error", "state rate_N_s, or name flights in [release]");
  for (const std::string& key : files::key_names(describe_disturbance))
    if (!ball && table.has(key))
      table.refuse(key, "", "has no effect without a limit on the ball", "add max_ball_m");
  return [declared, ball, line = table.line()](Evidence& evidence, Checks& checks) {
    const stability::FlownLoop& setup = evidence.tracking();
    stability::DisturbanceSource source = declared.declared;
    if (ball) source = disturbance(declared, evidence);
    const stability::TrackingReport report = tracking_bounds(setup, source, {});
    Check check = row("theorem", line);
    if (report.theorem.applies) {
      pass(check);
      check.witness = fmt::format("lambda_min(Lambda) {:.6g} 1/s, lambda_min(K) {:.6g} kg/s",
                                  report.theorem.min_Lambda, report.theorem.min_K);
    } else {
      fail(check, fmt::format("{}", fmt::join(report.theorem.why_not, "; ")));
    }
    checks.push_back(check);
    if (!ball) return;
    Check of_ball = row("theorem.ball", *ball);
    if (report.ball_m && report.flown_ball_m && report.saturation.is_proved()) {
      const double ball_m = std::max(*report.ball_m, *report.flown_ball_m);
      judge(of_ball, *ball, ball_m, ball_m);
      of_ball.witness =
          fmt::format("rate of the force error {:.4g} N/s, {}", source.rate_norm_N_s, source.kind);
    } else if (report.ball_m) {
      of_ball.reason =
          report.saturation.is_proved()
              ? "the ball is that of the continuous loop: nothing bounds the coupled sampled loop"
              : fmt::format(
                    "the ball of {:.6g} m holds only if the thrust does not saturate, which is "
                    "{}: {}",
                    *report.ball_m, stability::name(report.saturation.verdict), report.saturation.why);
    } else {
      of_ball.reason = "the theorem gives no ball for these gains and this force error";
    }
    checks.push_back(std::move(of_ball));
  };
}

}  // namespace swarmcert::gate
