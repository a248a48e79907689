/// @file Results of a diagnosis as text.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/diagnose.h"
#include "analysis/identification/fleet/difference.h"
#include "analysis/residuals/force_unit.h"

namespace swarmcert::analysis {

/// Prints the diagnosis of one kind of vehicle as text.
void print_diagnosis(const identification::Diagnosis& diagnosis, const residuals::ForceUnit& unit);

/// What is said if no effect is missing.
std::string no_effect_words(const identification::Diagnosis& diagnosis);

/// The variable with which much of the force that is left varies; empty: none.
std::string varies_with(const identification::Diagnosis& diagnosis);

/// Returns what was not counted and why, and what is left.
std::vector<std::string> left_sentences(const identification::Diagnosis& diagnosis,
                                        const residuals::ForceUnit& unit);

/// What the sizes of Diagnosis::detectable are.
inline constexpr char kDetectableWords[] = "Smallest sizes that 9 of 10 flights like these would have shown";

/// Describes what the ranking of `difference` is based on.
std::string in_words(const identification::Difference& difference);

/// Returns flights that would answer open questions, best first: set points, if a log lacks them and there is anything
/// to confirm; flights that separate the rivals of each effect, then flights for effects that could not have been
/// detected at any size.
/// @param wants_all false: the last only while a part of the force is unexplained
std::vector<std::string> next_flights(const identification::Diagnosis& diagnosis, bool wants_all);

}  // namespace swarmcert::analysis
