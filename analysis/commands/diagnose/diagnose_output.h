/// @file Results of a diagnosis as text.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/diagnose.h"
#include "analysis/identification/fleet/difference.h"

namespace swarmcert::analysis {

/// Prints the diagnosis of one kind of vehicle as text.
void print_diagnosis(const identification::Diagnosis& diagnosis);

/// Describes what the ranking of `difference` is based on.
std::string in_words(const identification::Difference& difference);

/// Returns flights that would answer open questions, best first: set points, if a log lacks them and there is anything
/// to confirm; flights that separate the rivals of each effect, then flights for effects that could not have been
/// detected at any size.
std::vector<std::string> next_flights(const identification::Diagnosis& diagnosis);

}  // namespace swarmcert::analysis
