#include "analysis/gate/policy.h"

#include <cmath>
#include <filesystem>
#include <iterator>
#include <map>

#include "nn/base/file_io.h"
#include "nn/base/file_keys.h"
#include "nn/base/input_error.h"
#include "nn/base/text.h"
#include "nn/base/toml.h"
#include "stability/model.h"

namespace swarmcert::gate {
namespace {

using files::TomlTable;

constexpr char kSchema[] = "swarmcert/policy/1";
const std::vector<std::string> kPrecisions = {"float32", "float64"};

/// Files that are named by one key each.
struct ReleaseFile {
  const char *key, *meaning;
  std::string Release::*path;
};
constexpr ReleaseFile kReleaseFiles[] = {
    {"certificate", "Of the network.", &Release::certificate},
    {"box", "box.toml.", &Release::box},
    {"gains", "gains.toml.", &Release::gains},
    {"model", "model.toml.", &Release::model},
    {"source", "The exported source, a folder or file.", &Release::source},
    {"elf", "The firmware.", &Release::elf},
    {"facts", "firmware-facts.json.", &Release::facts},
    {"swarm", "swarm.toml.", &Release::swarm},
    {"promise", "Result of bound --coverage.", &Release::promise},
    {"vehicles", "flights.toml.", &Release::vehicles},
    {"columns", "columns.toml of the flights.", &Release::columns}};

/// Resolves `path` relative to the folder of the policy, unless it is absolute.
std::string resolve(const std::string& policy, const std::string& path) {
  return (std::filesystem::path(policy).parent_path() / path).lexically_normal().string();
}

/// Reads the layer order under `key`, for a file that the policy must name.
std::vector<std::string> read_order(const TomlTable& table, const char* key, bool has_file) {
  if (!table.has(key)) return {};
  if (!has_file) table.refuse(key, "", "belongs to a file that is not named here");
  std::vector<std::string> layers = table.texts(key);
  if (layers.empty()) table.refuse(key, "[]", "names no layer");
  return layers;
}

/// Reads the flights and the number of their logs.
void read_recordings(const TomlTable& table, const std::string& policy, Release& release) {
  if (!table.has("flights")) {
    if (table.has("logs")) table.refuse("logs", "", "belongs to flights, which are not named here");
    return;
  }
  const std::vector<std::string> words =
      table.is_list("flights") ? table.texts("flights") : std::vector<std::string>{table.text("flights")};
  if (words.empty()) table.refuse("flights", "[]", "names no flight");
  for (const std::string& word : words) release.flights.push_back(resolve(policy, word));
  if (!table.has("logs"))
    table.refuse("logs", "", "is missing",
                 "state how many logs the flights are, so that a missing one is noticed");
  const double logs = table.number("logs");
  if (!(logs >= 1 && logs <= 1e6) || logs != std::floor(logs))
    table.refuse("logs", "", "must be a whole number from 1 on");
  release.logs = static_cast<int>(logs);
}

void describe_release(files::Keys& keys) {
  using Layers = std::vector<std::string>;
  keys.may<std::string>("network", "network.toml or a weight file.");
  keys.may<std::string>("phi", "Weight file, with rho in place of network.");
  keys.may<std::string>("rho", "Likewise.");
  keys.may<std::string>("key", "Of the state dict inside a nested checkpoint.");
  keys.may<Layers>("order", "Of the layers of network.");
  keys.may<Layers>("phi_order", "Of the layers of phi.");
  keys.may<Layers>("rho_order", "Of the layers of rho.");
  keys.may("precision", "In flight.", "", files::OneOf{kPrecisions});
  for (const ReleaseFile& one : kReleaseFiles) keys.may<std::string>(one.key, one.meaning);
  keys.may<files::TextOrTexts>("flights", "Reference flights.");
  keys.may<int>("logs", "How many logs the flights are, so that a missing one is noticed.");
  keys.may<double>("battery_V", "Of the theorem and of the thrust.", "V");
  keys.may<int>("most_neighbours", "Of the export in elf; absent: the default of export.");
  keys.may<bool>("feed_forward", "Whether the network's force is part of the model.");
}

Release read_release(const TomlTable& table, const std::string& policy) {
  table.allow_only(files::key_names(describe_release));
  Release release;
  const auto file = [&](const char* key) {
    if (!table.has(key)) return std::string();
    if (table.text(key).empty()) table.refuse(key, "\"\"", "names no file");
    return resolve(policy, table.text(key));
  };
  release.network.file = file("network");
  release.network.phi = file("phi");
  release.network.rho = file("rho");
  if (table.has("key")) release.network.key = table.text("key");
  release.network.order = read_order(table, "order", !release.network.file.empty());
  release.network.phi_order = read_order(table, "phi_order", !release.network.phi.empty());
  release.network.rho_order = read_order(table, "rho_order", !release.network.rho.empty());
  if (release.network.phi.empty() != release.network.rho.empty())
    table.refuse(release.network.phi.empty() ? "rho" : "phi", "", "needs both phi and rho");
  if (!release.network.phi.empty() && !release.network.file.empty())
    table.refuse("network", "", "conflicts with phi and rho", "name one or the other");
  if (table.has("precision")) release.is_float32 = table.choice("precision", kPrecisions) == 0;
  for (const ReleaseFile& one : kReleaseFiles) release.*one.path = file(one.key);
  read_recordings(table, policy, release);
  if (table.has("battery_V")) release.battery_V = table.number("battery_V");
  if (!(release.battery_V > 0)) table.refuse("battery_V", "", "must be positive");
  if (table.has("most_neighbours")) release.most_neighbours = whole_number(table, "most_neighbours", 0);
  if (table.has("feed_forward")) release.feed_forward = table.flag("feed_forward");
  if (release.feed_forward && release.network.file.empty())
    table.refuse("feed_forward", "true", "needs a network");
  return release;
}

}  // namespace

void describe_policy_file(files::Keys& keys) {
  keys.schema(kSchema);
  keys.must_table("release", "Files of the release.", describe_release);
  for (const CheckKind& kind : check_kinds()) {
    if (kind.describe_keys == nullptr)
      keys.may<std::map<std::string, std::string>>(kind.name, kind.summary);
    else
      keys.may_table(kind.name, kind.summary, kind.describe_keys);
  }
}

Policy read_policy(const std::string& path) {
  const std::string text = files::read_file(path);
  const auto document = files::parse_toml(text, path);
  const TomlTable top(document, path);
  top.require_schema(kSchema);
  top.allow_only(files::key_names(describe_policy_file));
  Policy policy;
  policy.path = path;
  policy.release = read_release(top.table("release"), path);
  policy.release_line = top.line("release");
  for (const std::string& key : top.table("release").keys()) policy.named.insert(key);
  if (policy.release.has_network()) policy.named.insert("network");
  for (const CheckKind& kind : check_kinds()) {
    if (!top.has(kind.name)) {
      policy.not_run.emplace_back(kind.name);
      continue;
    }
    const TomlTable table = top.table(kind.name);
    if (kind.describe_keys != nullptr) table.allow_only(files::key_names(kind.describe_keys));
    for (const std::string& key : files::split_at_commas(kind.needs)) require_file(table, policy, key);
    policy.checks.push_back({kind.name, table.line(), kind.read(table, policy)});
  }
  if (policy.checks.empty()) top.refuse("", "", "asks for no check", "add a table, such as [certificate]");
  policy.conditions = conditions_of_policy(text, path);
  return policy;
}

std::optional<Limit> limit(const TomlTable& table, const std::string& key, const std::string& unit,
                           bool is_most) {
  if (!table.has(key)) return std::nullopt;
  Limit result;
  result.value = table.number(key);
  result.line = table.line(key);
  result.unit = unit;
  result.is_most = is_most;
  return result;
}

void describe_force_limit(files::Keys& keys, const char* meaning, const std::string& stem,
                          const std::string& suffix) {
  keys.may<double>(stem + "_gf" + suffix, meaning, "gf");
  keys.may<double>(stem + "_N" + suffix, meaning, "N");
  keys.may<double>(stem, meaning);
}

std::optional<Limit> force_limit(const TomlTable& table, const std::string& stem, const std::string& suffix,
                                 bool is_most) {
  std::optional<Limit> found;
  const std::string keys[] = {stem + "_gf" + suffix, stem + "_N" + suffix, stem};
  const std::string units[] = {"gf", "N", ""};
  const double unit_N[] = {stability::kGramForce_N, 1, 0};
  for (std::size_t i = 0; i < std::size(keys); ++i) {
    if (!table.has(keys[i])) continue;
    if (found) table.refuse(keys[i], "", "states the limit twice", "give it in one unit");
    found = limit(table, keys[i], units[i], is_most);
    found->unit_N = unit_N[i];
  }
  return found;
}

int whole_number(const TomlTable& table, const std::string& key, int otherwise) {
  if (!table.has(key)) return otherwise;
  const double value = table.number(key);
  if (!(value >= 1 && value <= 1000) || value != std::floor(value))
    table.refuse(key, "", "must be a whole number from 1 to 1000");
  return static_cast<int>(value);
}

void require_file(const TomlTable& table, const Policy& policy, const std::string& key,
                  const std::string& otherwise) {
  if (policy.named.count(key) == 0)
    table.refuse("", "", "needs a file that [release] does not name", "add " + key + otherwise + " there");
}

void refuse_without_limit(const TomlTable& table, const std::string& example) {
  table.refuse("", "", "states no limit", "add one, such as " + example);
}

}  // namespace swarmcert::gate
