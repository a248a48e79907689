#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "analysis/gate/checks/checks.h"
#include "analysis/gate/checks/force_unit.h"
#include "analysis/gate/evidence.h"
#include "lipschitz/base/box.h"
#include "nn/base/json.h"
#include "nn/base/toml.h"
#include "nn/weights/function_id.h"

namespace swarmcert::gate {
namespace {

struct WantedBound {
  std::string name;                           ///< row name
  std::optional<files::FunctionId> function;  ///< empty: the plain network and every set function
  std::string block;
  Limit limit;
};

/// Requires that the box of the certificate, on which its bounds hold, contains the box of the release.
void require_certified_box(Evidence& evidence) {
  if (evidence.release().certificate.empty()) throw Unfounded("bounds on a box need a certificate");
  const files::Json& certified = evidence.certificate()["box"];
  for (const auto& [part, box] : evidence.domain()) {
    if (!certified.is_object() || !certified.contains(part.name()))
      throw Unfounded("the certificate has no box for " + part.name() + ": certify with --domain");
    const std::vector<double> lower = files::parse_hex_floats(certified[part.name()]["lower"]);
    const std::vector<double> upper = files::parse_hex_floats(certified[part.name()]["upper"]);
    bool is_inside = lower.size() == box.lower.size();
    for (std::size_t k = 0; is_inside && k < lower.size(); ++k)
      is_inside = lower[k] <= box.lower[k] && box.upper[k] <= upper[k];
    if (!is_inside)
      throw Unfounded("the certificate's box does not contain the release's, for " + part.name());
  }
}

void judge_bounds(Evidence& evidence, const WantedBound& wanted, bool on_box, Checks& checks) {
  Check check = row(wanted.name, wanted.limit);
  double upper = -1, lower = -1;
  for (const LipschitzBound& bound : evidence.bounds()) {
    if (bound.block != wanted.block || (bound.domain != "global" && !on_box)) continue;
    if (wanted.function ? bound.function != *wanted.function : !bound.function.is_whole()) continue;
    const double scale = wanted.limit.unit_N > 0 ? force_scale(evidence, wanted.limit) : 1;
    if (bound.lower) lower = std::max(lower, round_down(*bound.lower * scale));
    const double scaled = scale == 1 ? bound.upper : round_up(bound.upper * scale);
    check.unit =
        wanted.limit.unit_N > 0
            ? wanted.limit.unit + bound.unit.substr(std::min(bound.unit.size(), bound.unit.find('/')))
            : bound.unit;
    if (scaled <= upper) continue;
    upper = scaled;
    check.witness = bound.lower ? fmt::format("{}: a slope of {:.6g} is attained", bound.function.name(),
                                              *bound.lower * scale)
                                : bound.function.name();
  }
  if (upper < 0) {
    check.reason = fmt::format(
        "no {}bound of {} for the block {} is proved: certify with --blocks={}", on_box ? "" : "global ",
        wanted.function ? wanted.function->name() : "the whole network", wanted.block, wanted.block);
  } else {
    judge(check, wanted.limit, upper, lower);
  }
  checks.push_back(std::move(check));
}

}  // namespace

Run read_lipschitz(const files::TomlTable& table, Policy& policy) {
  std::vector<std::string> known = {"domain", "functions"};
  for (const auto& keys :
       {force_keys("max_joint"), force_keys("max_position", "_m"), force_keys("max_velocity", "_s_m")})
    known.insert(known.end(), keys.begin(), keys.end());
  table.allow_only(known);
  if (!policy.release.has_network()) require_file(table, "", "network");
  std::vector<WantedBound> all;
  const auto add = [&all](const char* name, const char* block, const std::optional<Limit>& limit) {
    if (limit) all.push_back({name, std::nullopt, block, *limit});
  };
  add("lipschitz", "all", force_limit(table, "max_joint"));
  add("lipschitz.position", "position", force_limit(table, "max_position", "_m"));
  add("lipschitz.velocity", "velocity", force_limit(table, "max_velocity", "_s_m"));
  for (const WantedBound& wanted : all)
    if (wanted.block != "all") policy.blocks.push_back(wanted.block);
  if (table.has("functions")) {
    const files::TomlTable functions = table.table("functions");
    for (const std::string& name : functions.keys()) {
      const std::optional<files::FunctionId> function = files::FunctionId::parse(name);
      if (!function)
        functions.refuse(
            name, "",
            "is not a function: \"network\", \"phi:<kind>\", \"rho:<kind>\" or \"set:<phi>:<rho>\"");
      all.push_back({"lipschitz." + name, function, "all", *limit(functions, name, "")});
    }
  }
  if (all.empty()) refuse_without_limit(table, "max_joint_gf = 500");
  const bool on_box = table.has("domain") && table.choice("domain", {"global", "box"}) == 1;
  return [all, on_box](Evidence& evidence, Checks& checks) {
    if (on_box) require_certified_box(evidence);
    for (const WantedBound& wanted : all) judge_bounds(evidence, wanted, on_box, checks);
  };
}

}  // namespace swarmcert::gate
