#include <fmt/core.h>

#include <algorithm>
#include <map>

#include "analysis/gate/checks/checks.h"
#include "analysis/gate/checks/force_unit.h"
#include "analysis/gate/evidence.h"
#include "lipschitz/base/box.h"
#include "nn/base/file_keys.h"
#include "nn/base/json.h"
#include "nn/base/toml.h"
#include "nn/weights/function_id.h"
#include "nn/weights/functions.h"

namespace swarmcert::gate {
namespace {

/// A function to which a limit applies has no proved bound: the check is inconclusive.
struct MissingBound : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct WantedBound {
  std::string name;                           ///< row name
  std::optional<files::FunctionId> function;  ///< empty: the plain network and every set function
  std::string block;
  Limit limit;
};

const std::vector<std::string> kDomains = {"global", "box"};

/// The box of the release, and how the box of the certificate, on which its bounds of domain "box" hold, compares.
struct ReleaseBox {
  lipschitz::Domain domain;
  std::string why_not_inside;  ///< empty: the certificate's box contains it
  bool is_certified_box = false;
};

ReleaseBox release_box(Evidence& evidence) {
  ReleaseBox result;
  result.domain = evidence.domain();
  if (evidence.release().certificate.empty()) {
    result.why_not_inside = "bounds on a box need a certificate";
    return result;
  }
  const files::Json& certified = evidence.certificate()["box"];
  result.is_certified_box = true;
  for (const auto& [part, box] : result.domain) {
    if (!certified.is_object() || !certified.contains(part.name()))
      return {result.domain, "the certificate has no box for " + part.name() + ": certify with --domain"};
    const std::vector<double> lower = files::parse_hex_floats(certified[part.name()]["lower"]);
    const std::vector<double> upper = files::parse_hex_floats(certified[part.name()]["upper"]);
    bool is_inside = lower.size() == box.lower.size();
    for (std::size_t k = 0; is_inside && k < lower.size(); ++k)
      is_inside = lower[k] <= box.lower[k] && box.upper[k] <= upper[k];
    if (!is_inside)
      return {result.domain, "the certificate's box does not contain the release's, for " + part.name()};
    result.is_certified_box = result.is_certified_box && lower == box.lower && upper == box.upper;
  }
  return result;
}

bool is_inside(const std::optional<ReleaseBox>& box, const files::FunctionId& function) {
  return !box || (box->is_certified_box && box->domain.count(function.input_part()) == 1);
}

/// Returns the least bound of each function to which the limit applies.
/// @throws MissingBound if one has none: without it, the limit says nothing about that function.
std::vector<LipschitzBound> least_bounds(Evidence& evidence, const WantedBound& wanted,
                                         const std::optional<ReleaseBox>& box) {
  std::map<files::FunctionId, LipschitzBound> found;
  for (const LipschitzBound& bound : evidence.bounds()) {
    if (bound.block != wanted.block || (bound.domain != "global" && !box)) continue;
    if (wanted.function ? bound.function != *wanted.function : !bound.function.is_whole()) continue;
    if (bound.domain != "global" && !box->why_not_inside.empty()) throw Unfounded(box->why_not_inside);
    const auto [at, is_new] = found.emplace(bound.function, bound);
    if (!is_new && bound.upper < at->second.upper) at->second = bound;
  }
  std::vector<LipschitzBound> least;
  for (const files::FunctionId& function : files::functions(evidence.flown())) {
    if (wanted.function ? function != *wanted.function : !function.is_whole()) continue;
    const std::vector<std::string> blocks = files::blocks(evidence.flown(), function);
    if (wanted.block != "all" && std::count(blocks.begin(), blocks.end(), wanted.block) == 0) continue;
    if (found.count(function) == 0)
      throw MissingBound(fmt::format("no {}bound of {} for the block {} is proved: certify {}",
                                     box ? "" : "global ", function.name(), wanted.block,
                                     wanted.block != "all" ? "with --blocks=" + wanted.block
                                     : box                 ? "the whole network"
                                                           : "without --domain"));
    least.push_back(found.at(function));
  }
  if (least.empty())
    throw MissingBound(fmt::format("the network has no {} with a block {}",
                                   wanted.function ? wanted.function->name() : "function", wanted.block));
  return least;
}

/// @param box of the release, if the limits hold on it only: bounds over all inputs hold there too, but a slope counts
///   against a limit only if it is known to lie inside.
Check judged_bounds(Evidence& evidence, const WantedBound& wanted, const std::optional<ReleaseBox>& box) {
  Check check = row(wanted.name, wanted.limit);
  std::vector<LipschitzBound> bounds;
  try {
    bounds = least_bounds(evidence, wanted, box);
  } catch (const MissingBound& error) {
    check.reason = error.what();
    return check;
  }
  double upper = -1, lower = -1;
  for (const LipschitzBound& bound : bounds) {
    const double scale = wanted.limit.unit_N > 0 ? force_scale(evidence, wanted.limit) : 1;
    const bool is_attained = bound.lower && is_inside(box, bound.function);
    if (is_attained) lower = std::max(lower, round_down(*bound.lower * scale));
    const double scaled = scale == 1 ? bound.upper : round_up(bound.upper * scale);
    check.unit =
        wanted.limit.unit_N > 0
            ? wanted.limit.unit + bound.unit.substr(std::min(bound.unit.size(), bound.unit.find('/')))
            : bound.unit;
    if (scaled <= upper) continue;
    upper = scaled;
    check.witness = is_attained ? fmt::format("{}: a slope of {:.6g} is attained", bound.function.name(),
                                              *bound.lower * scale)
                                : bound.function.name();
  }
  judge(check, wanted.limit, upper, lower);
  if (box && check.verdict == Verdict::kInconclusive && !box->is_certified_box)
    check.reason += "; certify with the box of the release: --method branch --domain";
  return check;
}

}  // namespace

void describe_lipschitz_keys(files::Keys& keys) {
  describe_force_limit(keys, "Of the joint bound, per unit of input.", "max_joint");
  describe_force_limit(keys, "Per relative position.", "max_position", "_m");
  describe_force_limit(keys, "Per relative velocity.", "max_velocity", "_s_m");
  keys.may("domain", "On which the bounds must hold; global if absent.", "", files::OneOf{kDomains});
  keys.may<std::map<std::string, double>>("functions", "By function: network, phi:KIND, set:KIND:KIND.");
}

Run read_lipschitz(const files::TomlTable& table, Policy& policy) {
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
  const bool on_box = table.has("domain") && table.choice("domain", kDomains) == 1;
  return [all, on_box](Evidence& evidence, Checks& checks) {
    std::optional<ReleaseBox> box;
    if (on_box) box = release_box(evidence);
    for (const WantedBound& wanted : all) checks.push_back(judged_bounds(evidence, wanted, box));
  };
}

}  // namespace swarmcert::gate
