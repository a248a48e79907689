#include "lipschitz/values/range.h"

#include <fmt/core.h>

#include <algorithm>

#include "analysis/gate/checks/checks.h"
#include "analysis/gate/checks/force_unit.h"
#include "nn/base/file_keys.h"
#include "nn/base/toml.h"
#include "nn/weights/function_id.h"

namespace swarmcert::gate {
namespace {

using lipschitz::Attained;
using lipschitz::CertifiedRange;

std::string range_words(const CertifiedRange& range, const Attained& attained) {
  std::string text = fmt::format("{} attains {:.6g}", range.function.name(), attained.value);
  for (std::size_t j = 0; j < attained.points.size(); ++j) {
    text += fmt::format("{} {} (", j == 0 ? " at" : ",", attained.networks[j].name());
    for (std::size_t k = 0; k < attained.points[j].size(); ++k)
      text += fmt::format("{}{:.4g}", k == 0 ? "" : ", ", attained.points[j][k]);
    text += ")";
  }
  return text;
}

/// The quantity that a limit bounds.
enum class RangeQuantity { kLargest, kLeast, kGreatest, kJump };

struct WantedRange {
  std::string name;
  RangeQuantity quantity;
  Limit limit;
};

void judge_range(Evidence& evidence, const WantedRange& wanted, const std::vector<CertifiedRange>& ranges,
                 Checks& checks) {
  Check check = row(wanted.name, wanted.limit);
  const double scale = force_scale(evidence, wanted.limit);
  bool is_first = true;
  double proved = 0, attained = nothing_attained(wanted.limit);
  const double sign = wanted.limit.is_most ? 1 : -1;
  for (const CertifiedRange& range : ranges) {
    const Attained& reached =
        wanted.quantity == RangeQuantity::kLeast ? range.least
        : wanted.quantity == RangeQuantity::kLargest && -range.least.value > range.greatest.value
            ? range.least
            : range.greatest;
    const double bound = wanted.quantity == RangeQuantity::kLeast      ? range.lower
                         : wanted.quantity == RangeQuantity::kGreatest ? range.upper
                         : wanted.quantity == RangeQuantity::kJump     ? range.jump
                                                                       : range.largest();
    double value = reached.value * scale;
    if (wanted.quantity == RangeQuantity::kLargest) value = std::abs(value);
    if (wanted.quantity != RangeQuantity::kJump && sign * value > sign * attained) {
      attained = sign > 0 ? round_down(value) : round_up(value);
      check.witness = range_words(range, reached);
    }
    const double scaled = scale == 1 ? bound : sign > 0 ? round_up(bound * scale) : round_down(bound * scale);
    if (is_first || sign * scaled > sign * proved) proved = scaled;
    is_first = false;
  }
  if (is_first) {
    check.reason = "the network has no function to bound";
  } else {
    judge(check, wanted.limit, proved, attained);
  }
  checks.push_back(std::move(check));
}

}  // namespace

void describe_range_keys(files::Keys& keys) {
  describe_force_limit(keys, "Of the magnitude.", "max_abs_force");
  describe_force_limit(keys, "", "max_force");
  describe_force_limit(keys, "", "min_force");
  describe_force_limit(keys, "When a neighbour comes or goes.", "max_jump");
  keys.may<int>("neighbours", "At most.");
}

Run read_range(const files::TomlTable& table, Policy&) {
  std::vector<WantedRange> all;
  const auto add = [&](const char* name, const char* stem, RangeQuantity quantity, bool is_most) {
    if (const auto limit = force_limit(table, stem, "", is_most)) all.push_back({name, quantity, *limit});
  };
  add("range", "max_abs_force", RangeQuantity::kLargest, true);
  add("range.max_force", "max_force", RangeQuantity::kGreatest, true);
  add("range.min_force", "min_force", RangeQuantity::kLeast, false);
  add("range.jump", "max_jump", RangeQuantity::kJump, true);
  if (all.empty()) refuse_without_limit(table, "max_abs_force_gf = 80");
  lipschitz::RangeOptions options;
  options.neighbours = whole_number(table, "neighbours", 1);
  return [all, options](Evidence& evidence, Checks& checks) mutable {
    options.jobs = evidence.settings().jobs;
    std::map<std::string, double> rho;
    for (const auto& [function, bound] : evidence.global_bounds())
      if (function.is_rho()) rho[function.kind()] = bound;
    const auto ranges = lipschitz::ranges(evidence.flown(), evidence.domain(), rho, options);
    for (const WantedRange& wanted : all) judge_range(evidence, wanted, ranges, checks);
  };
}

}  // namespace swarmcert::gate
