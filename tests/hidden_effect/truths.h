/// @file The hidden effects: truths of the library's form and of other forms.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "hidden_effect/other_simulator.h"

namespace swarmcert::tests {

/// Time constant of the rotors for all truths with a lag.
inline constexpr double kUsualLag_s = 0.06;

/// A hidden effect, or none.
struct Hidden {
  std::string name;
  Truth truth;
  std::set<std::string> answers;  ///< correct names, any of them
  std::set<std::string> allowed =
      {};  ///< may also be reported: what the library's form leaves of another form
  int vehicles = 1;
  bool is_foreign = false;  ///< gust or force outside the library: must be flagged as unexplained
  /// For truths of the library's form: the parameter and its true value.
  std::string parameter = {};
  double value = 0;
  double tolerance = 0.1;
};

/// Returns at least ten single effects of the library's form and of other forms.
std::vector<Hidden> single_effects();
/// Returns gusts and forces that no effect of the library describes.
std::vector<Hidden> foreign_forces();
/// Returns single effects in a gust: both must be reported.
std::vector<std::vector<Hidden>> disturbed();
/// Returns pairs of `single_effects()`.
std::vector<std::vector<Hidden>> pairs();
/// Returns a truth with both effects.
Truth together(const Truth& a, const Truth& b);

}  // namespace swarmcert::tests
