/// @file What a diagnosis of all kinds of vehicles comes to in one word.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/diagnose.h"

namespace swarmcert::identification {

enum class Verdict {
  kMissingEffect,   ///< at least one effect of the library is missing
  kUnexplained,     ///< none is, and something is left that none explains
  kNothingMissing,  ///< every kind was judged and nothing is left
  kInconclusive     ///< neither of these, and a kind has too few records or a remainder that cannot be judged
};

/// "missing_effect", "unexplained", "nothing_missing", "inconclusive".
const char* name(Verdict verdict);

/// Of the mean square of the force's error: what a scan explains beyond this is worth naming.
inline constexpr double kMuchOfForce = 0.1;

/// Whether something stands out in what is left after the effects that were found: slow disturbances from the spectrum
/// of the noise, a variable that explains a tenth of the mean square that is left, or half of that of a torque or
/// rotor.
bool leaves_something(const Diagnosis& diagnosis);

/// The first of the enumeration that holds for `diagnoses`.
/// @param reason receives why the verdict is inconclusive, else nothing.
Verdict verdict_of(const std::vector<Diagnosis>& diagnoses, std::string& reason);

}  // namespace swarmcert::identification
