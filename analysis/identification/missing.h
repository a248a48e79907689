/// @file An effect that a model lacks, with its numbers and how well they are known.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "analysis/identification/closed_loop.h"
#include "analysis/identification/findings.h"
#include "analysis/identification/refinement.h"

namespace swarmcert::identification {

/// A found effect in the words of the model file.
struct Missing {
  std::string effect, equivalence_class, kind, excitation;
  Finding finding;
  std::map<std::string, double> parameters;
  std::map<std::string, Interval> intervals;  ///< 90 %, statistical
  std::vector<std::string> coefficients;      ///< names, in the order of finding.model_form and `instrument`
  std::vector<InstrumentedValue> instrument;  ///< of each coefficient; empty where there is no check
  std::vector<stability::EffectSpec> specs;   ///< for the model file
};

/// What was selected as effects that are missing, in its order.
std::vector<Missing> ranking_of(const Passes& passes, const Selected& selected);

/// `missing` with the numbers of `refined`, a fit of the same effect.
/// @param grams of the flights that it is fitted to
Missing with_numbers(const Passes& passes, const Refined& refined, const Missing& missing,
                     const Grams& grams);

/// The numbers of `missing` for with_effects().
std::vector<stability::EffectSpec> specs_of(const std::vector<Missing>& missing);

}  // namespace swarmcert::identification
