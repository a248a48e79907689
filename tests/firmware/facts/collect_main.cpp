// Writes firmware-facts.json from the measurements of facts.cmake:
//   firmware_facts NETWORK COUNTS SIZES COMPILER FLAGS OUTPUT GRAPH.ci...
// COUNTS: lines "NAME INSTRUCTIONS CYCLES TAKEN_BRANCHES". SIZES: arm-none-eabi-size -B -t of the app's objects.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <map>
#include <sstream>
#include <stdexcept>

#include "call_graph.h"
#include "cycle_counter.h"
#include "nn/base/file_io.h"
#include "nn/base/json.h"
#include "nn/weights/functions.h"

namespace {

using swarmcert::files::Json;

/// The maximum of each quantity over all runs with the same name.
struct Cost {
  std::uint64_t instructions = 0;
  double least_us = 0, most_us = 0;  ///< for 1 and for 3 additional cycles per taken branch
};

std::map<std::string, Cost> read_costs(const std::string& path) {
  std::map<std::string, Cost> costs;
  std::istringstream lines(swarmcert::files::read_file(path));
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string name;
    std::uint64_t instructions = 0, cycles = 0, branches = 0;
    if (!(words >> name >> instructions >> cycles >> branches)) continue;
    const auto us = [](std::uint64_t count) {  // rounded up to 0.1
      return std::ceil(10 * static_cast<double>(count) / swarmcert::cycle_model::kClock_MHz) / 10;
    };
    Cost& cost = costs[name];
    cost.instructions = std::max(cost.instructions, instructions);
    cost.least_us = std::max(cost.least_us, us(cycles + branches));
    cost.most_us = std::max(cost.most_us, us(cycles + 3 * branches));
  }
  if (costs.empty()) throw std::runtime_error(path + ": no counts");
  return costs;
}

Json json_of(const Cost& cost) {
  return {{"instructions", cost.instructions}, {"modelled_us", {cost.least_us, cost.most_us}}};
}

/// Replaces the numbers that the image uses for the kinds of phi and rho by their names.
Json network_costs(const swarmcert::files::Network& network, std::map<std::string, Cost>& costs) {
  Json result = Json::object();
  const auto take = [&](const std::string& counted, const std::string& name) {
    const auto found = costs.find(counted);
    if (found == costs.end()) return;
    result[name] = json_of(found->second);
    costs.erase(found);
  };
  int phi = 0, rho = 0;
  for (const auto& [kind, weights] : network.phi) {
    if (kind == swarmcert::files::kGroundKind) {
      take("ground", "phi:" + kind);
    } else {
      take("phi_" + std::to_string(phi++), "phi:" + kind);
    }
  }
  for (const auto& [kind, weights] : network.rho) take("rho_" + std::to_string(rho++), "rho:" + kind);
  return result;
}

Json stack_of(const swarmcert::facts::CallGraph& graph, const std::string& entry) {
  const swarmcert::facts::StackUse use = graph.worst(entry);
  return {{"bytes", use.bytes}, {"path", use.path}, {"outside", use.outside}};
}

/// Total size of code with constants and of variables over all objects: the last line of `size -B -t`.
Json sizes(const std::string& path) {
  const std::string text = swarmcert::files::read_file(path);
  const std::size_t total = text.rfind("(TOTALS)");
  if (total == std::string::npos) throw std::runtime_error(path + ": no totals");
  std::istringstream words(text.substr(text.rfind('\n', total) + 1));
  std::uint64_t code = 0, data = 0, bss = 0;
  if (!(words >> code >> data >> bss)) throw std::runtime_error(path + ": no sizes");
  return {{"flash_bytes", code + data}, {"ram_bytes", data + bss}};
}

int run(char** arguments, int count) {
  const swarmcert::files::Network network = swarmcert::files::load_network({{}, arguments[1], "", ""});
  std::map<std::string, Cost> costs = read_costs(arguments[2]);
  swarmcert::facts::CallGraph graph;
  for (int i = 7; i < count; ++i) graph.add(swarmcert::files::read_file(arguments[i]));

  Json weights = Json::object();
  for (const auto& [part, one] : swarmcert::files::parts(network))
    weights[part.name()] = {{"sha256", one->sha256}};
  Json facts = {
      {"schema", "swarmcert/firmware-facts/1"},
      {"tool", "swarmcert " SWARMCERT_VERSION},
      {"network", {{"sha256", network.sha256}, {"weights", std::move(weights)}}},
      {"target", "STM32F405 (Cortex-M4F) at 168 MHz, flash with 5 wait states"},
      {"compiler", arguments[4]},
      {"flags", arguments[5]},
      {"statement",
       "Instructions are counted under QEMU. Times are modelled, not measured: from a taken branch "
       "costing 1 cycle more to one costing 3, caches empty at the start, no interrupts. Stack is the "
       "worst chain of calls, with 64 bytes for a function of the stock firmware. Flash and RAM are of "
       "the app's objects, without the task's stack."}};
  facts["parts"] = network_costs(network, costs);
  Json functions = Json::object();
  for (const auto& [name, cost] : costs) functions[name] = json_of(cost);
  facts["functions"] = std::move(functions);
  facts["stack"] = {{"network_task", stack_of(graph, "appMain")},
                    {"controller", stack_of(graph, "controllerOutOfTree")},
                    {"self_test", stack_of(graph, "controllerOutOfTreeTest")},
                    {"largest_frame_bytes", graph.largest_frame()}};
  facts.update(sizes(arguments[3]));
  swarmcert::files::write_file(arguments[6], facts.dump(2) + "\n", true);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 8) {
    std::fputs("firmware_facts NETWORK COUNTS SIZES COMPILER FLAGS OUTPUT GRAPH.ci...\n", stderr);
    return 2;
  }
  try {
    return run(argv, argc);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "firmware_facts: %s\n", error.what());
    return 3;
  }
}
