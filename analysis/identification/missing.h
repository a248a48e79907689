/// @file An effect that a model lacks, with its values and their uncertainty.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "analysis/identification/findings.h"
#include "analysis/identification/refinement.h"
#include "analysis/identification/selected.h"

namespace swarmcert::identification {

/// A missing effect in the terms of the model file.
struct Missing {
  std::string effect, equivalence_class, kind, excitation;
  Finding finding;
  std::map<std::string, double> parameters;
  std::map<std::string, Interval> intervals;  ///< 90 %, statistical
  std::vector<std::string> coefficients;      ///< names, in the order of finding.model_form and `instrument`
  /// Of each coefficient; empty if no check is possible, or if a shape is fitted too: these values hold it fixed, and
  /// their intervals would leave out how far it is known.
  std::vector<InstrumentedValue> instrument;
  std::vector<stability::EffectSpec> specs;  ///< for the model file
};

/// Sets `instrument` of `missing`, which `refined` fitted.
void set_instrument(const Refined& refined, const std::vector<InstrumentedValue>& checks, Missing& missing);

/// Returns the selected effects as missing effects, in their order.
std::vector<Missing> ranking_of(const Passes& passes, const Selected& selected);

/// Returns `missing` with the values of `refined`, a fit of the same effect.
/// @param grams of the flights used for the fit
Missing with_numbers(const Passes& passes, const Refined& refined, const Missing& missing,
                     const Grams& grams);

/// Returns the specs of `missing` for with_effects().
std::vector<stability::EffectSpec> specs_of(const std::vector<Missing>& missing);

}  // namespace swarmcert::identification
