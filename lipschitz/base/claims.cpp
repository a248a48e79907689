#include "lipschitz/base/claims.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "nn/base/file_io.h"
#include "nn/base/file_keys.h"
#include "nn/base/json.h"
#include "nn/base/toml.h"
#include "nn/weights/functions.h"

namespace swarmcert::lipschitz {
namespace {

bool contains(const std::vector<std::string>& list, const std::string& text) {
  return std::find(list.begin(), list.end(), text) != list.end();
}

/// Whether `function` takes inputs of NET rather than hidden values.
bool takes_inputs(const files::FunctionId& function) { return !function.is_rho(); }

/// Whether there are claims about `function` in a weighted norm of its inputs.
bool takes_scale(const files::Network& network, const files::FunctionId& function, std::size_t scales) {
  return takes_inputs(function) && static_cast<std::size_t>(files::inputs(network, function)) == scales;
}

/// Returns the groups of neighbours named by the options.
std::vector<Neighbours> groups(const files::Network& network, const ClaimOptions& options) {
  std::vector<Neighbours> result;
  for (const auto& [kind, phi] : network.phi) {
    if (kind != files::kGroundKind && options.neighbours > 0) result.push_back({{kind, options.neighbours}});
  }
  for (const auto& [kind, count] : options.mixture) {
    if (network.phi.count(kind) == 0 || kind == files::kGroundKind)
      throw std::invalid_argument("there are no neighbours of kind \"" + kind + "\"");
    if (count < 1) throw std::invalid_argument("a number of neighbours is below 1");
  }
  if (!options.mixture.empty()) result.push_back(options.mixture);
  return result;
}

/// Adds claims for given groups of neighbours: for each group, those of the set functions whose moving term belongs to
/// the group or is the ground's.
void add_counted(const files::Network& network, const ClaimOptions& options, std::vector<Claim>& claims) {
  for (const Neighbours& group : groups(network, options)) {
    for (const files::FunctionId& function : files::functions(network)) {
      if (!function.is_set()) continue;
      const std::string kind = function.input_part().kind();
      if (kind != files::kGroundKind && group.count(kind) == 0) continue;
      Claim claim;
      claim.function = function;
      claim.domain = "box";
      claim.neighbours = group;
      claims.push_back(std::move(claim));
    }
  }
}

Box read_box(const files::TomlTable& table, std::size_t inputs) {
  Box box{table.numbers("lower"), table.numbers("upper")};
  for (const auto& [key, numbers] : {std::pair{"lower", &box.lower}, std::pair{"upper", &box.upper}}) {
    if (numbers->size() != inputs)
      table.refuse(key, std::to_string(numbers->size()) + " numbers",
                   "there are " + std::to_string(inputs) + " inputs");
  }
  for (std::size_t k = 0; k < inputs; ++k) {
    if (box.lower[k] > box.upper[k])
      table.refuse("lower", files::Json(box.lower[k]).dump(),
                   "entry " + std::to_string(k) + " is above upper, " + files::Json(box.upper[k]).dump());
  }
  return box;
}

}  // namespace

const char* name(LawKind law) {
  return law == LawKind::kAllStacked ? "all_stacked" : law == LawKind::kAllMax ? "all_max" : "own_state";
}

std::vector<Claim> claims(const files::Network& network, const ClaimOptions& options) {
  std::vector<Claim> result;
  std::vector<std::string> unused = options.blocks;
  unused.erase(std::remove(unused.begin(), unused.end(), "every"), unused.end());  // may match none
  bool scale_fits = options.scale.empty();
  for (const double scale : options.scale) {
    if (!(scale > 0) || std::isinf(scale)) throw std::invalid_argument("a scale must be positive");
  }
  for (const files::FunctionId& function : files::functions(network)) {
    Claim claim;
    claim.function = function;
    if (!options.domain.empty() && takes_inputs(function)) claim.domain = "box";
    result.push_back(claim);
    for (const std::string& block : files::blocks(network, function)) {
      const bool is_named = contains(options.blocks, block);
      if (!is_named && !contains(options.blocks, "every")) continue;
      unused.erase(std::remove(unused.begin(), unused.end(), block), unused.end());
      claim.block = block;
      result.push_back(claim);
    }
    claim.block = "all";
    if (options.scale.empty() || !takes_scale(network, function, options.scale.size())) continue;
    scale_fits = true;
    claim.scale = options.scale;
    result.push_back(claim);
  }
  if (!unused.empty()) throw std::invalid_argument("no function has a block \"" + unused.front() + "\"");
  if (!scale_fits)
    throw std::invalid_argument("no function has " + std::to_string(options.scale.size()) +
                                " inputs, the number of entries of scale");
  if (options.counted && !options.domain.empty()) add_counted(network, options, result);
  return result;
}

std::vector<LawClaim> law_claims(const files::Network& network, const ClaimOptions& options) {
  const std::vector<Neighbours> named = groups(network, options);  // validates the options even without a rho
  std::vector<LawClaim> result;
  for (const auto& [rho, weights] : network.rho) {
    for (const Neighbours& group : named) {
      for (const std::string block : {"all", "position", "velocity"}) {
        const std::vector<std::string> has =
            files::blocks(network, files::FunctionId::set(group.begin()->first, rho));
        const bool wanted = contains(options.blocks, block) || contains(options.blocks, "every");
        if (block != "all" && !(wanted && contains(has, block))) continue;
        for (const LawKind law : {LawKind::kAllStacked, LawKind::kAllMax, LawKind::kOwnState})
          result.push_back({rho, group, block, law});
      }
    }
  }
  return result;
}

namespace {

constexpr const char* kBoxSchema = "swarmcert/box/1";

void describe_sides(files::Keys& keys) {
  keys.must<std::vector<double>>("lower", "Lower end of each input, in the order of the network's inputs.");
  keys.must<std::vector<double>>("upper", "Upper end of each input.");
}

}  // namespace

void describe_box_file(files::Keys& keys) {
  keys.schema(kBoxSchema);
  describe_sides(keys);
  keys.may_table("ground", "The same for the ground's input, where the network has one.", describe_sides);
}

Domain read_domain(const std::string& path, const files::Network& network) {
  const std::string text = files::read_file(path);
  const toml::table document = files::parse_toml(text, path);
  const files::TomlTable top(document, path);
  top.require_schema(kBoxSchema);
  top.allow_only(files::key_names(describe_box_file));
  Domain domain;
  if (network.plain) {
    if (top.has("ground")) top.refuse("ground", "", "the network has no ground term");
    domain["network"] = read_box(top, static_cast<std::size_t>(network.plain->inputs()));
    return domain;
  }
  std::size_t inputs = 0;
  for (const auto& [kind, phi] : network.phi) {
    if (kind != files::kGroundKind) inputs = static_cast<std::size_t>(phi.inputs());
  }
  if (inputs > 0) {
    const Box box = read_box(top, inputs);
    for (const auto& [kind, phi] : network.phi) domain[files::FunctionId::phi(kind)] = box;
  }
  const bool has_ground = network.phi.count(files::kGroundKind) == 1;
  if (!has_ground && top.has("ground")) top.refuse("ground", "", "the network has no ground term");
  if (!has_ground) return domain;
  Box& ground = domain[files::FunctionId::ground_phi()];
  if (top.has("ground")) {
    const files::TomlTable table = top.table("ground");
    table.allow_only(files::key_names(describe_sides));
    ground = read_box(table, files::kGroundInputs);
  } else if (inputs < files::kGroundInputs) {
    top.refuse("ground", "", "is missing, and the box has too few intervals for the ground's inputs");
  } else {
    ground.lower.assign(ground.lower.end() - files::kGroundInputs, ground.lower.end());
    ground.upper.assign(ground.upper.end() - files::kGroundInputs, ground.upper.end());
  }
  return domain;
}

}  // namespace swarmcert::lipschitz
