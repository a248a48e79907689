/// @file Formulas for what is left: a small search over physical forms, judged by their description length.
///
/// A formula costs half the logarithm of the number of independent samples for each of its numbers, and saves half that
/// number times the logarithm of the fall of the error (Schwarz 1978). How many samples are independent follows from
/// the correlation of what the best formula leaves from one sample to the next.
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
  double saved_bits = 0;         ///< against a constant
  double share = 0;              ///< as ScanEntry::share, on the samples of the fit
  std::size_t entry = 0;         ///< of Scan::entries
};

/// For the first `most_entries` of `scan` that formulas can express, the best formula each; by saved_bits, best first.
std::vector<Formula> find_formulas(const ScanSamples& samples, const Scan& scan, std::size_t most_entries,
                                   int jobs);

/// `formula` as a candidate of a selection: its shape where it is.
Candidate candidate_of(const Formula& formula, const stability::Model& model);

/// [[effect]] with [effect.expression], as a model file has it.
std::string to_toml(const Formula& formula);

/// So many are looked for where somebody asks for formulas.
inline constexpr std::size_t kMostFormulas = 8;

/// Names of effects that find_formulas() makes begin so.
inline constexpr char kFormulaPrefix[] = "formula_";
bool is_formula(const std::string& effect);

}  // namespace swarmcert::identification
