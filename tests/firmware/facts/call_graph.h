/// @file Worst-case stack of a function and everything that it calls, from GCC's -fcallgraph-info=su.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

namespace swarmcert::facts {

/// Stack assumed for a function whose code is not in the graph: the stock firmware's, memcpy and the like.
inline constexpr int kOutside_bytes = 64;

struct StackUse {
  int bytes = 0;
  std::vector<std::string> path;  ///< the call path that needs it, from the entry on
  std::set<std::string> outside;  ///< functions without code in the graph, anywhere below the entry
};

class CallGraph {
 public:
  /// Adds the contents of one .ci file. @throws std::runtime_error for a function whose frame has no fixed size.
  void add(const std::string& text);

  /// Returns the largest stack use of `entry` and everything it calls; functions outside the graph count as
  /// kOutside_bytes.
  /// @throws std::runtime_error if there is no such function, or if it can reach recursion or a call through a pointer.
  StackUse worst(const std::string& entry) const;

  int largest_frame() const;

 private:
  struct Function {
    std::string name;  ///< as in the source
    int bytes = -1;    ///< size of its frame; -1: outside
    std::set<std::string> calls;
  };

  StackUse worst(const std::string& entry, std::set<std::string>& above) const;

  std::map<std::string, Function> functions_;
};

}  // namespace swarmcert::facts
