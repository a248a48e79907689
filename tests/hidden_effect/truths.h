/// @file What hidden effects there are: truths of the library's form and of others.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "hidden_effect/other_simulator.h"

namespace swarmcert::tests {

/// Time constant of the rotors wherever a truth has a lag.
inline constexpr double kUsualLag_s = 0.06;

/// One hidden effect, or none.
struct Hidden {
  std::string name;
  Truth truth;
  std::set<std::string> answers;  ///< names that are right, any of them
  std::set<std::string> allowed =
      {};  ///< may be named besides: what the library's form leaves of another form
  int vehicles = 1;
  bool is_foreign = false;  ///< gust, or a force outside the library: must be flagged as unexplained
  /// Same-form truths: the parameter and its true value.
  std::string parameter = {};
  double value = 0;
  double tolerance = 0.1;
};

/// At least ten single effects, of the library's form and of others.
std::vector<Hidden> single_effects();
/// Gusts and forces that no effect of the library has.
std::vector<Hidden> foreign_forces();
/// Single effects in a gust: both must be said.
std::vector<std::vector<Hidden>> disturbed();
/// Pairs of `single_effects()` at once.
std::vector<std::vector<Hidden>> pairs();
/// Both truths at once.
Truth together(const Truth& a, const Truth& b);

}  // namespace swarmcert::tests
