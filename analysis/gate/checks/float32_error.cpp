#include "lipschitz/values/float32_error.h"

#include <fmt/core.h>

#include "analysis/gate/checks/checks.h"
#include "analysis/gate/checks/force_unit.h"
#include "nn/base/file_keys.h"
#include "nn/base/toml.h"

namespace swarmcert::gate {

void describe_float32_error_keys(files::Keys& keys) {
  describe_force_limit(keys, "Of the error.", "max_error");
  keys.may<int>("neighbours", "At most.");
  keys.may<double>("input_step", "Of the inputs in flight.");
}

Run read_float32_error(const files::TomlTable& table, Policy&) {
  const std::optional<Limit> limit = force_limit(table, "max_error");
  if (!limit) refuse_without_limit(table, "max_error_gf = 0.05");
  lipschitz::Float32Options options;
  options.neighbours = whole_number(table, "neighbours", 1);
  options.input_step = table.has("input_step") ? table.number("input_step") : 0;
  if (options.input_step < 0) table.refuse("input_step", "", "must not be negative");
  return [limit = *limit, options](Evidence& evidence, Checks& checks) mutable {
    if (!evidence.release().is_float32) throw Unfounded("the policy states that float64 is used in flight");
    options.jobs = evidence.settings().jobs;
    const auto errors =
        lipschitz::float32_errors(evidence.flown(), evidence.domain(), evidence.global_bounds(), options);
    Check check = row("float32_error", limit);
    const double scale = force_scale(evidence, limit);
    double worst = -1;
    for (const lipschitz::Float32Error& error : errors) {
      const double total = scale == 1 ? error.total.value() : round_up(error.total.value() * scale);
      if (total <= worst) continue;
      worst = total;
      check.witness = fmt::format("{}, up to {} neighbours", error.function.name(), error.neighbours_at_most);
    }
    if (errors.empty()) {
      check.reason = "none of the functions of the network is used in flight";
    } else {
      judge(check, limit, worst, nothing_attained(limit));
    }
    checks.push_back(std::move(check));
  };
}

}  // namespace swarmcert::gate
