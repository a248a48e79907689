#include "analysis/gate/conditions.h"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <sstream>

#include "analysis/gate/evidence.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/base/toml.h"
#include "stability/gains.h"

namespace swarmcert::gate {
namespace {

using files::Json;

/// Which value of an entry makes the stronger claim. Sets of numbers are compared member by member.
enum class Order {
  kUnknown,   ///< no value is known to be, nor whether stating one is
  kFixed,     ///< no value is known to be, but stating one is stronger than stating none
  kSmaller,   ///< limits that a value may not exceed, and what is available to the vehicle
  kLarger,    ///< limits that a value may not fall below, and errors that are assumed
  kWider,     ///< [from, to]: what holds on an interval holds on every part of it
  kLater,     ///< the later word of Rule::words
  kPinned,    ///< any value; stating one is stronger than stating none
  kReleased,  ///< a file that is released: not a condition, but listed
};

constexpr char kMeasured[] = "measured", kInfinite[] = "infinite";
/// The entry of a set of limits that holds for members without one of their own.
constexpr char kOthers[] = "others";
constexpr char kOfFile[] = "a file", kOfClamp[] = "all that the clamp lets through";

struct Rule {
  const char* keys;  ///< "*" stands for any text; "*." at the beginning for any table
  Order order = Order::kUnknown;
  Json otherwise = {};  ///< value of an entry that is left out of its table; null: it claims nothing
  std::vector<std::string> words = {};
};

bool fits(const std::string& pattern, const std::string& key) {
  const std::size_t star = pattern.find('*');
  if (star == std::string::npos) return pattern == key;
  const std::string head = pattern.substr(0, star), tail = pattern.substr(star + 1);
  return key.size() >= head.size() + tail.size() && key.compare(0, head.size(), head) == 0 &&
         key.compare(key.size() - tail.size(), tail.size(), tail) == 0;
}

/// The first rule that fits a key is its rule.
const std::vector<Rule>& rules() {
  const std::vector<std::string> quantiles = {"p50", "p95", "p99", "max"};
  static const std::vector<Rule> all = {
      {"release.battery_V", Order::kSmaller, 4.2},
      {"release.logs", Order::kLarger},
      {"release.precision", Order::kUnknown, "float32"},
      {"release.feed_forward", Order::kUnknown, false},
      {"release.most_neighbours", Order::kLarger, 10},
      {"release.*key", Order::kUnknown},
      {"release.*order", Order::kUnknown},
      {"release.*", Order::kPinned},
      {"hashes.*", Order::kPinned},
      {"lipschitz.domain", Order::kLater, "global", {"box", "global"}},
      {"lipschitz.functions", Order::kSmaller},
      {"float32_error.neighbours", Order::kLarger, 1},
      {"float32_error.input_step", Order::kLarger, 0},
      {"range.neighbours", Order::kLarger, 1},
      {"match.entry", Order::kLater, "network", {"network", "controller"}},
      {"tracking.over", Order::kLater, "box", {"corners", "box"}},
      {"tracking.guard_factor", Order::kLarger, kMeasured},
      {"tracking.guard_quantile", Order::kLater, "p95", quantiles},
      {"tracking.velocity_error_m_s", Order::kLarger},
      {"tracking.position_error_m", Order::kLarger, 0},
      {"tracking.uncertainty.mass_kg", Order::kWider, "usual"},
      {"tracking.uncertainty.thrust_scale", Order::kWider, "usual"},
      {"tracking.uncertainty.lag_s", Order::kWider, "usual"},
      {"tracking.uncertainty.delay_s", Order::kWider, "usual"},
      {"*.quantile", Order::kLater, {}, quantiles},
      {"*.rate_N_s", Order::kLarger},
      {"*.amplitude_N", Order::kLarger},
      {"*.variation_N", Order::kLarger},
      {"*.impulse_N_s", Order::kLarger},
      {"*.bias_N", Order::kLarger},
      {"firmware_facts.stack_bytes", Order::kSmaller},
      {"firmware_facts.parts_us", Order::kSmaller},
      {"firmware_facts.functions_us", Order::kSmaller},
      {"regression.max_increase_percent", Order::kSmaller},
      {"box", Order::kLater, {}, {kOfFile, kOfClamp}},
      {"box.*", Order::kWider},
      {"network.unit", Order::kFixed},
      {"vehicle.*", Order::kFixed},
      {"inputs.network", Order::kReleased},
      {"inputs.weights", Order::kReleased},
      {"inputs.certificate", Order::kReleased},
      {"inputs.gains", Order::kReleased},
      {"inputs.source", Order::kReleased},
      {"inputs.elf", Order::kReleased},
      {"inputs.facts", Order::kReleased},
      {"inputs.model", Order::kFixed},
      {"inputs.network of a model", Order::kFixed},
      {"inputs.swarm", Order::kFixed},
      {"inputs.promise", Order::kFixed},
      {"inputs.log", Order::kFixed},
      {"*.max_*", Order::kSmaller},
      {"*.max", Order::kSmaller},
      {"*.min_*", Order::kLarger},
  };
  return all;
}

const Rule& rule_of(const std::string& key) {
  static const Rule unknown = {"*"}, presence = {"*", Order::kPinned};
  const std::string entry = key.substr(std::min(key.find('.'), key.size()));
  for (const Rule& rule : rules()) {
    const std::string keys = rule.keys;
    const bool is_of_any_table = keys.rfind("*.", 0) == 0;
    if (is_of_any_table ? fits(keys.substr(1), entry) : fits(keys, key)) return rule;
  }
  return entry.empty() ? presence : unknown;
}

Json json_of(const toml::node& node) {
  if (const auto* list = node.as_array()) {
    Json values = Json::array();
    for (const toml::node& one : *list) values.push_back(json_of(one));
    return values;
  }
  if (const auto* table = node.as_table()) {
    Json values = Json::object();
    for (const auto& [key, value] : *table) values[std::string(key.str())] = json_of(value);
    return values;
  }
  if (const auto number = node.value<double>(); number && node.is_number()) return *number;
  if (const auto flag = node.as_boolean()) return flag->get();
  return node.value_or(std::string());
}

/// Fills in what entries that are left out of `table` mean.
void add_defaults(const std::string& table, Conditions& conditions) {
  for (const Rule& rule : rules()) {
    const std::string keys = rule.keys;
    if (!rule.otherwise.is_null() && keys.rfind(table + ".", 0) == 0 && keys.find('*') == std::string::npos)
      conditions.emplace(keys, rule.otherwise);
  }
}

/// The force error of [tracking] and [theorem]: classes that are not declared do not restrict it; if none is declared,
/// it is measured on the flights, and so is the error of the velocity.
void add_force_error(const std::string& table, bool has_flights, Conditions& conditions) {
  const char* const classes[] = {"rate_N_s", "amplitude_N", "variation_N", "impulse_N_s"};
  const auto key = [&table](const char* entry) { return table + "." + entry; };
  const bool is_declared = std::any_of(std::begin(classes), std::end(classes),
                                       [&](const char* entry) { return conditions.count(key(entry)) == 1; });
  for (const char* const entry : classes) conditions.emplace(key(entry), is_declared ? kInfinite : kMeasured);
  conditions.emplace(key("bias_N"), is_declared ? Json(0) : Json(kMeasured));
  conditions.emplace(key("quantile"), is_declared ? "none" : "p99");
  if (table == "tracking")
    conditions.emplace(key("velocity_error_m_s"), is_declared || !has_flights ? Json(0) : Json(kMeasured));
}

double number_of(const Json& value) {
  if (value.is_number()) return value.get<double>();
  return value == kInfinite ? std::numeric_limits<double>::infinity()
                            : std::numeric_limits<double>::quiet_NaN();
}

bool is_number(const Json& value) { return value.is_number() || value == kInfinite; }

/// True if [from, to] `inner` lies in `outer`, or each interval of a list in the same one of the other.
bool contains(const Json& outer, const Json& inner) {
  if (!outer.is_array() || !inner.is_array() || outer.size() != inner.size() || outer.empty()) return false;
  if (outer[0].is_array()) {
    for (std::size_t i = 0; i < outer.size(); ++i)
      if (!contains(outer[i], inner[i])) return false;
    return true;
  }
  return outer.size() == 2 && number_of(outer[0]) <= number_of(inner[0]) &&
         number_of(inner[1]) <= number_of(outer[1]);
}

/// True if the claim with the value `a` implies that with the value `b`.
bool implies(const Rule& rule, const Json& a, const Json& b) {
  if (a == b || rule.order == Order::kReleased) return true;
  if (b.is_null()) return rule.order != Order::kUnknown;
  if (a.is_null() || rule.order == Order::kUnknown || rule.order == Order::kFixed) return false;
  if (a.is_object() && b.is_object()) {  // limits of members
    for (const auto& [member, limit] : b.items()) {
      const Json own = a.contains(member) ? a[member] : a.value(kOthers, Json());
      if (!implies(rule, own, limit)) return false;
    }
    // A member with a looser limit than the others' is none of `b`'s.
    for (const auto& [member, limit] : a.items())
      if (!b.contains(member) && b.contains(kOthers) && !implies(rule, limit, b[kOthers])) return false;
    return true;
  }
  switch (rule.order) {
    case Order::kSmaller:
      return is_number(a) && is_number(b) && number_of(a) <= number_of(b);
    case Order::kLarger:
      return is_number(a) && is_number(b) && number_of(a) >= number_of(b);
    case Order::kWider:
      return contains(a, b);
    case Order::kLater: {
      const auto place = [&rule](const Json& word) {
        const std::string text = word.is_string() ? word.get<std::string>() : "";
        return std::find(rule.words.begin(), rule.words.end(), text);
      };
      return place(a) != rule.words.end() && place(b) != rule.words.end() && place(a) >= place(b);
    }
    case Order::kPinned:
      return true;
    case Order::kUnknown:
    case Order::kFixed:
    case Order::kReleased:
      break;
  }
  return false;
}

Change::Claim claim_of(const std::string& key, const Json& before, const Json& now) {
  const Rule& rule = rule_of(key);
  const bool keeps = implies(rule, now, before), is_kept = implies(rule, before, now);
  if (keeps && is_kept) return Change::Claim::kSame;
  if (keeps) return Change::Claim::kStronger;
  return is_kept ? Change::Claim::kWeaker : Change::Claim::kOpen;
}

std::string text_of(const Json& value) {
  if (value.is_null()) return "none";
  if (value.is_number()) return fmt::format("{:.6g}", value.get<double>());
  if (!value.is_string()) return value.dump();
  const auto text = value.get<std::string>();
  const bool is_hash = text.size() == 64 && text.find_first_not_of("0123456789abcdef") == std::string::npos;
  return is_hash ? text.substr(0, 16) + "..." : text;
}

}  // namespace

Conditions conditions_of_policy(const std::string& text, const std::string& path) {
  const toml::table document = files::parse_toml(text, path);
  Conditions conditions;
  const auto* release = document["release"].as_table();
  const bool has_flights = release != nullptr && release->contains("flights");
  for (const auto& [name, node] : document) {
    const std::string table(name.str());
    const auto* entries = node.as_table();
    if (entries == nullptr) continue;  // the schema
    conditions[table] = true;
    for (const auto& [entry, value] : *entries) {
      const std::string key = table + "." + std::string(entry.str());
      if (key == "tracking.uncertainty") {
        for (const auto& [parameter, interval] : *value.as_table())
          conditions[key + "." + std::string(parameter.str())] = json_of(interval);
      } else {
        conditions[key] = json_of(value);
      }
    }
    if (table == "tracking" || table == "theorem") add_force_error(table, has_flights, conditions);
    add_defaults(table, conditions);
  }
  // Percentages of single rows hold in place of the general one.
  const auto percent = conditions.find("regression.max_increase_percent");
  if (percent != conditions.end()) {
    const auto own = conditions.find("regression.percent_of");
    Json all = own == conditions.end() ? Json::object() : own->second;
    all[kOthers] = percent->second;
    percent->second = std::move(all);
    conditions.erase("regression.percent_of");
  }
  return conditions;
}

Conditions conditions_of(Evidence& evidence) {
  const Policy& policy = evidence.policy();
  Conditions conditions = policy.conditions;
  const auto if_readable = [](const auto& add) {
    try {
      add();
    } catch (const files::InputError&) {  // the checks report what is wrong with the file
    } catch (const Unfounded&) {
    }
  };
  const auto& release = policy.release;
  const auto judged_on = conditions.find("lipschitz.domain");
  if (conditions.count("range") + conditions.count("float32_error") > 0 ||
      (judged_on != conditions.end() && judged_on->second == "box"))
    conditions["box"] = release.box.empty() ? kOfClamp : kOfFile;
  if_readable([&] {  // limits without a unit are in the network's own
    if (release.has_network()) conditions["network.unit"] = evidence.flown().output_unit;
  });
  if_readable([&] {  // gains.toml also says what the vehicle does with the commands
    if (release.gains.empty()) return;
    const stability::Gains gains = stability::load_gains(release.gains);
    conditions["vehicle.motor_lag_s"] = gains.motor_lag_s;
    conditions["vehicle.attitude_lag_s"] = gains.attitude_lag_s;
    conditions["vehicle.body_rate_lag_s"] = gains.body_rate_lag_s;
    conditions["vehicle.delay_s"] = gains.delay_s;
    conditions["vehicle.network_rate_hz"] = gains.network_rate_hz;
    conditions["vehicle.network_latency_s"] = gains.network_latency_s;
  });
  if_readable([&] {
    if (release.box.empty()) return;
    for (const auto& [part, box] : evidence.domain()) {
      Json& intervals = conditions["box." + part.name()];
      for (std::size_t k = 0; k < box.lower.size(); ++k) intervals.push_back({box.lower[k], box.upper[k]});
    }
  });
  if_readable([&] {
    if (conditions.count("spectral_norms") == 0) return;
    const auto& gamma = evidence.flown().gamma;
    const bool has_own = conditions.count("spectral_norms.max") == 1;
    if (!has_own && gamma) conditions["spectral_norms.max"] = gamma->value;
    const bool is_of_network = gamma && gamma->scope == files::GammaStatement::Scope::kNetwork;
    conditions["spectral_norms.limited"] = is_of_network && !has_own ? "product of a network" : "every layer";
  });
  const auto folder = std::filesystem::absolute(policy.path).lexically_normal().parent_path();
  std::map<std::string, std::map<std::string, std::string>>
      inputs;  // sorted, as members are compared in order
  for (const EvidenceFile& file : evidence_files(policy, "")) {
    if (file.role == "policy" || file.role == "box") continue;
    if_readable([&] {
      const auto path = std::filesystem::absolute(file.path).lexically_normal().lexically_relative(folder);
      inputs["inputs." + file.role][path.string()] = files::sha256_of_file(file.path);
    });
  }
  for (const auto& [role, hashes] : inputs) conditions[role] = hashes;
  return conditions;
}

const char* name(Change::Claim claim) {
  switch (claim) {
    case Change::Claim::kWeaker:
      return "weaker";
    case Change::Claim::kOpen:
      return "open";
    case Change::Claim::kStronger:
      return "stronger";
    case Change::Claim::kSame:
      break;
  }
  return "same";
}

std::string words(const Change& change) {
  if (change.before == Json(true)) return change.key + ": the check was dropped";
  if (change.now == Json(true)) return change.key + ": the check was added";
  if (!change.before.is_object() || !change.now.is_object())
    return fmt::format("{}: {} before, {} now", change.key, text_of(change.before), text_of(change.now));
  std::string text;
  const auto add = [&](const std::string& member, const Json& before, const Json& now) {
    if (before != now)
      text += fmt::format("{}{}.{}: {} before, {} now", text.empty() ? "" : "; ", change.key, member,
                          text_of(before), text_of(now));
  };
  for (const auto& [member, before] : change.before.items())
    add(member, before, change.now.value(member, Json()));
  for (const auto& [member, now] : change.now.items())
    if (!change.before.contains(member)) add(member, Json(), now);
  return text;
}

std::vector<Change> changes(const Conditions& before, const Conditions& now) {
  std::vector<Change> all;
  const auto value = [](const Conditions& of, const std::string& key) {
    const auto found = of.find(key);
    return found == of.end() ? Json() : found->second;
  };
  const auto add = [&](const std::string& key) {
    const std::string table = key.substr(0, key.find('.'));
    const bool is_of_table = table != key && value(before, table) != value(now, table);
    const Json was = value(before, key), is = value(now, key);
    if (!is_of_table && was != is) all.push_back({key, was, is, claim_of(key, was, is)});
  };
  for (const auto& [key, was] : before) add(key);
  for (const auto& [key, is] : now)
    if (before.count(key) == 0) add(key);
  std::sort(all.begin(), all.end(), [](const Change& a, const Change& b) { return a.key < b.key; });
  return all;
}

}  // namespace swarmcert::gate
