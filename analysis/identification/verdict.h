/// @file Summarises a diagnosis of all kinds of vehicles in one word.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/diagnose.h"
#include "nn/base/record.h"

namespace swarmcert::identification {

enum class Verdict {
  kMissingEffect,   ///< at least one effect of the library is missing
  kUnexplained,     ///< no missing effect was found, but something is left unexplained
  kNothingMissing,  ///< each kind was judged and nothing is left
  kInconclusive     ///< none of these: a kind has too few records or a remainder that cannot be judged
};

/// Returns "missing_effect", "unexplained", "nothing_missing" or "inconclusive".
const char* name(Verdict verdict);
void describe(files::Record& record, Verdict verdict);

/// A scan result is significant if it explains more than this fraction of the mean square of the force error.
inline constexpr double kMuchOfForce = 0.1;

/// Returns whether something stands out after the effects found: slow disturbances or a vibration in the spectrum, a
/// variable that explains a tenth of the remaining mean square, or half of that of a torque or rotor.
bool leaves_something(const Diagnosis& diagnosis);

/// Returns the first value of the enumeration that applies to `diagnoses`.
/// @param reason receives why the verdict is inconclusive, else nothing
Verdict verdict_of(const std::vector<Diagnosis>& diagnoses, std::string& reason);

}  // namespace swarmcert::identification
