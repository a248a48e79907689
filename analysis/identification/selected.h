/// @file The effects that explain a residual, with their values.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/instrument.h"

namespace swarmcert::identification {

/// Effects with their thetas, values and checks.
struct Selected {
  Grams grams;
  Members members;
  std::vector<Refined> refined;                        ///< of `members`, in the same order
  std::vector<std::vector<InstrumentedValue>> checks;  ///< likewise; empty if no check is possible
};

/// Returns `effects` as candidates for instrument(): the gain of a lag is free, because it is what the check is about.
std::vector<Candidate> candidates_of(const std::vector<Refined>& effects);

/// Returns whether an effect is a fraction of the thrust, or a constant force.
bool is_scale(const std::string& effect);
bool is_push(const std::string& effect);

}  // namespace swarmcert::identification
