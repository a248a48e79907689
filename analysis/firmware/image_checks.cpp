#include "analysis/firmware/image_checks.h"

#include <fmt/core.h>

#include <algorithm>
#include <cstring>
#include <deque>
#include <map>
#include <set>
#include <unordered_set>

#include "analysis/firmware/app_in_image.h"
#include "analysis/firmware/export_source.h"
#include "analysis/firmware/match.h"
#include "nn/weights/functions.h"

namespace swarmcert::firmware {
namespace {

std::string bytes_of(const std::vector<double>& values) {
  const std::vector<float> narrow(values.begin(), values.end());
  return {reinterpret_cast<const char*>(narrow.data()), 4 * narrow.size()};
}

std::string bytes_of(const std::vector<double>& values, const Order& order) {
  std::vector<double> ordered;
  for (const std::size_t i : order) ordered.push_back(values[i]);
  return bytes_of(ordered);
}

constexpr std::size_t kRun_bytes = 16;

/// True if a run of four words says which numbers it holds: zeros and repeated words occur everywhere.
bool is_telling(const char* run) {
  std::uint32_t words[4];
  std::memcpy(words, run, sizeof words);
  return std::set<std::uint32_t>(words, words + 4).size() >= 3;
}

void add_runs(const std::string& bytes, std::unordered_set<std::string>& runs) {
  for (std::size_t at = 0; at + kRun_bytes <= bytes.size(); at += 4)
    if (is_telling(bytes.data() + at)) runs.insert(bytes.substr(at, kRun_bytes));
}

std::unordered_set<std::string> runs_of(const files::Network& network) {
  std::unordered_set<std::string> runs;
  for (const auto& [part, weights] : files::parts(network)) {
    for (const files::Layer& layer : weights->layers) {
      for (const Order& order : orders(layer)) add_runs(bytes_of(layer.weights, order), runs);
      add_runs(bytes_of(layer.biases), runs);
    }
  }
  return runs;
}

/// Targets of the direct calls and long jumps in a function. Literals between its instructions may look like one;
/// that only matters if they hit the first byte of a function.
std::set<std::uint32_t> targets_of(const ElfImage& image, const Symbol& function) {
  std::set<std::uint32_t> targets;
  const std::string code = image.bytes_at(function.address, function.size);
  const auto half = [&code](std::size_t at) {
    return static_cast<std::uint32_t>(static_cast<unsigned char>(code[at])) |
           static_cast<std::uint32_t>(static_cast<unsigned char>(code[at + 1])) << 8;
  };
  for (std::size_t at = 0; at + 2 <= code.size(); at += 2) {
    const std::uint32_t first = half(at);
    if ((first >> 11) < 0x1d) continue;  // 16 bit
    if (at + 4 > code.size()) break;
    const std::uint32_t second = half(at + 2);
    at += 2;
    if ((first & 0xf800u) != 0xf000u || (second & 0x9000u) != 0x9000u) continue;  // neither BL nor B.W
    const std::uint32_t sign = first >> 10 & 1u;
    const std::uint32_t i1 = ~((second >> 13 & 1u) ^ sign) & 1u, i2 = ~((second >> 11 & 1u) ^ sign) & 1u;
    std::uint32_t offset = i1 << 23 | i2 << 22 | (first & 0x3ffu) << 12 | (second & 0x7ffu) << 1;
    if (sign != 0) offset |= 0xff000000u;
    targets.insert(function.address + static_cast<std::uint32_t>(at) + 2 + offset);
  }
  return targets;
}

}  // namespace

std::vector<WeightsObject> weights_objects(const files::Network& network, const ElfImage& image) {
  std::vector<WeightsObject> objects;
  for (const auto& [part, weights] : files::parts(network)) {
    for (std::size_t k = 0; k < weights->layers.size(); ++k) {
      const files::Layer& layer = weights->layers[k];
      const std::string name = weights_object(network, part, k);
      objects.push_back(
          {image.find(name), name, bytes_of(layer.weights, orders(layer).back()) + bytes_of(layer.biases)});
    }
  }
  return objects;
}

std::string duplicate_symbol(const ElfImage& image) {
  std::map<std::string, std::uint32_t> seen;
  for (const Symbol& symbol : image.symbols) {
    if (!is_name_of_app(symbol.name) || symbol.name.find('.') != std::string::npos) continue;
    const auto [at, is_new] = seen.emplace(symbol.name, symbol.address);
    if (!is_new && at->second != symbol.address)
      return fmt::format("two symbols {}, at {:#x} and {:#x}", symbol.name, at->second, symbol.address);
  }
  return "";
}

std::string second_copy(const files::Network& network, const std::vector<WeightsObject>& objects,
                        const ElfImage& image) {
  const std::unordered_set<std::string> runs = runs_of(network);
  const auto is_known = [&objects](std::uint32_t address) {
    return std::any_of(objects.begin(), objects.end(), [address](const WeightsObject& object) {
      return object.symbol != nullptr && address >= object.symbol->address &&
             address - object.symbol->address < object.bytes.size();
    });
  };
  for (const Segment& segment : image.segments) {
    for (std::size_t at = 0; at + kRun_bytes <= segment.bytes.size(); ++at) {
      const auto address = static_cast<std::uint32_t>(segment.address + at);
      if (runs.count(segment.bytes.substr(at, kRun_bytes)) == 0 || is_known(address)) continue;
      return fmt::format("a second copy of weights at {:#x}, outside of the objects that hold them", address);
    }
  }
  return "";
}

std::vector<std::string> call_path(const ElfImage& image, const std::string& from, const std::string& to) {
  std::map<std::uint32_t, const Symbol*> functions;
  for (const Symbol& symbol : image.symbols)
    if (symbol.is_function && symbol.size > 0) functions.emplace(symbol.address, &symbol);
  const Symbol *const first = image.find(from), *const last = image.find(to);
  if (first == nullptr || last == nullptr) return {};
  std::map<std::uint32_t, std::uint32_t> caller = {{first->address, first->address}};
  std::deque<std::uint32_t> open = {first->address};
  while (!open.empty() && caller.count(last->address) == 0) {
    const auto function = functions.find(open.front());
    open.pop_front();
    if (function == functions.end()) continue;
    for (const std::uint32_t target : targets_of(image, *function->second))
      if (functions.count(target) == 1 && caller.emplace(target, function->first).second)
        open.push_back(target);
  }
  if (caller.count(last->address) == 0) return {};
  std::vector<std::string> path;
  for (std::uint32_t at = last->address;; at = caller[at]) {
    path.insert(path.begin(), functions[at]->name);
    if (at == first->address) return path;
  }
}

}  // namespace swarmcert::firmware
