/// @file Formulas for the remainder: a small search over physical forms, scored by description length.
///
/// Each parameter of a formula costs half the logarithm of the number of independent samples; the formula saves half
/// that number times the logarithm of the reduction of the error (Schwarz 1978). The number of independent samples
/// follows from the correlation between consecutive residuals of the best formula.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/candidates.h"
#include "analysis/identification/scan/scan.h"

namespace swarmcert::identification {

/// A fitted formula, ready for a model file.
struct Formula {
  std::string form, variable;    ///< "gaussian", "xy"
  stability::EffectSpec effect;  ///< with its numbers
  double saved_bits = 0;         ///< compared with a constant
  double share = 0;              ///< like ScanEntry::share, on the samples of the fit
  std::size_t entry = 0;         ///< index in Scan::entries
};

/// Returns the best formula for each of the first `most_entries` of `scan` that has one, sorted by saved_bits.
std::vector<Formula> find_formulas(const ScanSamples& samples, const Scan& scan, std::size_t most_entries,
                                   int jobs);

/// Returns `formula` as a candidate of a selection, starting at its shape.
Candidate candidate_of(const Formula& formula, const stability::Model& model);

/// Returns [[effect]] with [effect.expression], as in a model file.
std::string to_toml(const Formula& formula);

/// The fraction of samples that is counted as independent where their correlation is not estimated.
inline constexpr double kIndependentSamples = 0.2;

/// Number of formulas that are searched on request.
inline constexpr std::size_t kMostFormulas = 8;

/// Prefix of the names of effects created by find_formulas().
inline constexpr char kFormulaPrefix[] = "formula_";
bool is_formula(const std::string& effect);

}  // namespace swarmcert::identification
