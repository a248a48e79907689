#include "call_graph.h"

#include <algorithm>
#include <sstream>
#include <stdexcept>

namespace swarmcert::facts {
namespace {

/// Returns the quoted text after `field` in `line`; empty if there is none.
std::string quoted(const std::string& line, const std::string& field) {
  const std::size_t begin = line.find(field + ": \"");
  if (begin == std::string::npos) return "";
  const std::size_t first = begin + field.size() + 3;
  return line.substr(first, line.find('"', first) - first);
}

constexpr char kBytes[] = " bytes (";

}  // namespace

void CallGraph::add(const std::string& text) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind("edge:", 0) == 0) {
      functions_[quoted(line, "sourcename")].calls.insert(quoted(line, "targetname"));
    } else if (line.rfind("node:", 0) == 0) {
      Function& function = functions_[quoted(line, "title")];
      const std::string label = quoted(line, "label");
      if (function.name.empty()) function.name = label.substr(0, label.find("\\n"));
      const std::size_t bytes = label.rfind(kBytes);
      if (bytes == std::string::npos) continue;  // declared here, defined elsewhere
      if (label.compare(bytes + sizeof kBytes - 1, 7, "static)") != 0)
        throw std::runtime_error("no fixed stack: " + label);
      const std::size_t begin = label.rfind('n', bytes) + 1;  // after "\n"
      function.bytes = std::max(function.bytes, std::stoi(label.substr(begin, bytes - begin)));
    }
  }
}

StackUse CallGraph::worst(const std::string& entry) const {
  std::set<std::string> above;
  return worst(entry, above);
}

StackUse CallGraph::worst(const std::string& entry, std::set<std::string>& above) const {
  const auto found = functions_.find(entry);
  if (found == functions_.end()) throw std::runtime_error("no function " + entry);
  const Function& function = found->second;
  if (entry == "__indirect_call") throw std::runtime_error("a call through a pointer: its stack is unknown");
  if (!above.insert(entry).second) throw std::runtime_error("recursion: " + function.name);
  StackUse result;
  const bool is_outside = function.bytes < 0;
  for (const std::string& callee : function.calls) {
    StackUse below = worst(callee, above);
    result.outside.insert(below.outside.begin(), below.outside.end());
    if (below.bytes > result.bytes) {
      result.bytes = below.bytes;
      result.path = std::move(below.path);
    }
  }
  above.erase(entry);
  if (is_outside) result.outside.insert(function.name);
  result.bytes += is_outside ? kOutside_bytes : function.bytes;
  result.path.insert(result.path.begin(), function.name);
  return result;
}

int CallGraph::largest_frame() const {
  int largest = 0;
  for (const auto& [title, function] : functions_) largest = std::max(largest, function.bytes);
  return largest;
}

}  // namespace swarmcert::facts
