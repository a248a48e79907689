#include <fmt/core.h>

#include <algorithm>

#include "analysis/firmware/export_source.h"
#include "analysis/gate/checks/checks.h"
#include "analysis/gate/evidence.h"
#include "nn/base/file_keys.h"
#include "nn/base/input_error.h"
#include "nn/base/json.h"
#include "nn/base/toml.h"
#include "nn/weights/functions.h"

namespace swarmcert::gate {
namespace {

constexpr const char* kFactsSchema = "swarmcert/firmware-facts/1";
constexpr const char* kTasks[] = {"network_task", "controller", "self_test"};

using files::Json;

constexpr char kFlash[] = "flash_bytes";

struct Wanted {
  std::string name;  ///< row name
  std::vector<std::string>
      path;  ///< path of members to the number, or to a pair of which the larger one counts
  Limit limit;
};

[[noreturn]] void refuse(const std::string& file, const std::string& field, const std::string& what) {
  throw files::InputError({file, "", field, "", what, "build the target firmware_facts again"});
}

double number_at(const Json& facts, const std::vector<std::string>& path, const std::string& file) {
  const Json* at = &facts;
  std::string field;
  for (const std::string& member : path) {
    field += (field.empty() ? "" : ".") + member;
    if (!at->is_object() || !at->contains(member)) refuse(file, field, "is missing");
    at = &(*at)[member];
  }
  const Json& value = at->is_array() && !at->empty() ? at->back() : *at;
  if (!value.is_number() || !(value.get<double>() >= 0)) refuse(file, field, "is not a number from 0 on");
  return value.get<double>();
}

/// Returns why the facts do not belong to the network; empty if they do.
std::string why_of_another(Evidence& evidence, const Json& facts, const std::string& file) {
  const files::Network& network = evidence.flown();
  if (!facts.contains("network") || !facts["network"].is_object() || !facts["network"].contains("weights") ||
      !facts["network"]["weights"].is_object())
    refuse(file, "network.weights", "is missing");
  const Json& weights = facts["network"]["weights"];
  const files::Parts parts = files::parts(network);
  if (facts["network"].value("sha256", Json()) != Json(network.sha256)) return "another network.toml";
  if (weights.size() != parts.size()) return "other networks";
  for (const auto& [part, stored] : parts) {
    const std::string& name = part.name();
    if (!weights.contains(name) || !weights[name].is_object() ||
        weights[name].value("sha256", Json()) != Json(stored->sha256))
      return "other weights of " + name;
  }
  return "";
}

void describe_cost(files::Keys& keys) {
  keys.may<int>("instructions", "Counted under QEMU.");
  keys.must<Interval>("modelled_us", "Modelled, not measured: least and most.", "us");
}

void describe_stack(files::Keys& keys) {
  keys.must<int>("bytes", "", "bytes");
  keys.may<std::vector<std::string>>("path", "The worst chain of calls.");
  keys.may<std::vector<std::string>>("outside", "Functions of the stock firmware on it.");
}

}  // namespace

void describe_firmware_facts_file(files::Keys& keys) {
  keys.schema(kFactsSchema);
  keys.may<std::string>("tool", "Name and version of the tool that wrote this.");
  keys.must_table("network", "Network whose weights are in the program, and their bytes.",
                  [](files::Keys& network) {
                    network.must<std::string>("sha256", "Of network.toml.");
                    network.must_named_tables("weights", "By network.", [](files::Keys& weights) {
                      weights.must<std::string>("sha256", "Of the weight file.");
                    });
                  });
  keys.may<std::string>("target", "Processor.");
  keys.may<std::string>("compiler", "Compiler and version.");
  keys.may<std::string>("flags", "Options of the compiler.");
  keys.may<std::string>("statement", "How the numbers come about.");
  keys.must_named_tables("parts", "By network: phi:small, ...", describe_cost);
  keys.must_named_tables("functions", "Cycles or time of each function.", describe_cost);
  keys.must_table("stack", "Deepest stack of each task.", [](files::Keys& stack) {
    for (const char* const task : kTasks) stack.must_table(task, "", describe_stack);
    stack.may<int>("largest_frame_bytes", "", "bytes");
  });
  keys.must<int>("flash_bytes", "Size of program and constants.", "bytes");
  keys.must<int>("ram_bytes", "Size of variables.", "bytes");
}

void describe_firmware_facts_keys(files::Keys& keys) {
  keys.may<double>("max_flash_bytes", "", "bytes");
  keys.may<double>("max_ram_bytes", "", "bytes");
  keys.may<double>("max_stack_bytes", "Of every task.", "bytes");
  keys.may<std::map<std::string, double>>("stack_bytes", "By task.", "bytes");
  keys.may<std::map<std::string, double>>("parts_us", "By network: phi:small, ...", "us");
  keys.may<std::map<std::string, double>>("functions_us", "By function.", "us");
}

Run read_firmware_facts(const files::TomlTable& table, Policy&) {
  std::vector<Wanted> all;
  const auto add = [&](const char* key, const std::string& name, std::vector<std::string> path) {
    if (const auto limit = gate::limit(table, key, "bytes"))
      all.push_back({"firmware_facts." + name, std::move(path), *limit});
  };
  add("max_flash_bytes", "flash", {kFlash});
  add("max_ram_bytes", "ram", {"ram_bytes"});
  for (const char* entry : kTasks)
    add("max_stack_bytes", std::string("stack.") + entry, {"stack", entry, "bytes"});
  const auto add_table = [&](const char* key, const char* name, const char* member, const char* last,
                             const char* unit) {
    if (!table.has(key)) return;
    const files::TomlTable inner = table.table(key);
    for (const std::string& one : inner.keys())
      all.push_back(
          {fmt::format("firmware_facts.{}.{}", name, one), {member, one, last}, *limit(inner, one, unit)});
  };
  add_table("stack_bytes", "stack", "stack", "bytes", "bytes");
  add_table("parts_us", "parts", "parts", "modelled_us", "us");
  add_table("functions_us", "functions", "functions", "modelled_us", "us");
  if (all.empty()) refuse_without_limit(table, "max_flash_bytes = 65536");
  return [all, line = table.line()](Evidence& evidence, Checks& checks) {
    const std::string& file = evidence.release().facts;
    const Json facts = files::read_json(file, kFactsSchema);
    Check same = row("firmware_facts", line);
    const std::string why = why_of_another(evidence, facts, file);
    if (why.empty()) {
      pass(same);
      same.witness = "facts of these weights";
    } else {
      fail(same, "facts of " + why + ": build the target firmware_facts for this network");
    }
    checks.push_back(std::move(same));
    for (const Wanted& wanted : all) {
      Check check = row(wanted.name, wanted.limit);
      double value = number_at(facts, wanted.path, file);
      const long weights = firmware::weights_bytes(evidence.flown());
      if (wanted.path.front() == kFlash) value = std::max(value, static_cast<double>(weights));
      judge(check, wanted.limit, value, value);
      if (wanted.path.front() == kFlash && check.verdict == Verdict::kFail)
        check.reason +=
            fmt::format("; the network's weights take {}: {}", weights, firmware::kSmallerNetwork);
      checks.push_back(std::move(check));
    }
  };
}

}  // namespace swarmcert::gate
