/// @file Effects with their values in plain words: "an updraft of 35.2 mN at x 0.4 m, y -0.3 m, radius 0.3 m".
#pragma once

#include <map>
#include <string>
#include <vector>

namespace swarmcert::stability {

/// How forces are written: in a unit of `per_newton` to the newton.
struct ForceWords {
  double per_newton = 1;
  std::string name = "N";
};

/// An effect in words; {name} stands for the value of a parameter, with its unit.
struct Phrase {
  const char *effect, *leading;  ///< it holds if this parameter is not zero
  const char* text;
  const char*
      if_negative;  ///< where the sign of the leading parameter changes the words, its size then; else null
};

/// Returns the phrases of all effects, those of one effect in the order in which they are tried.
std::vector<Phrase> phrases();

/// Returns `effect` in words; empty for effects without a phrase: formulas, and effects that are registered elsewhere.
/// @param values as shown: factors are 1 where nothing is changed
std::string in_words(const std::string& effect, const std::map<std::string, double>& values,
                     const ForceWords& force);

}  // namespace swarmcert::stability
