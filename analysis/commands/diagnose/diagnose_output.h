/// @file Results of a diagnosis as JSON and as text.
#pragma once

#include <vector>

#include "analysis/identification/diagnose.h"
#include "analysis/identification/fleet/difference.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {

/// Prints the diagnosis of one kind of vehicle as text.
void print_diagnosis(const identification::Diagnosis& diagnosis);

/// Adds `verdict`, `ranking`, `unexplained`, `remainder`, `detectable`, `kinds`, `problems` and, if the verdict is
/// inconclusive, `reason`; forces in newton.
void add_diagnoses(const std::vector<identification::Diagnosis>& diagnoses, files::Json& result);

/// Adds `against`: per vehicle, which effects were held fixed, how the scatter is known, and what was found within it.
void add_differences(const std::vector<identification::Difference>& differences,
                     const std::vector<std::string>& other_flights, files::Json& result);

/// Describes what the ranking of `difference` is based on.
std::string in_words(const identification::Difference& difference);

/// Returns flights that would answer open questions, best first: flights that separate the rivals of each effect,
/// then flights for effects that could not have been detected at any size.
std::vector<std::string> next_flights(const identification::Diagnosis& diagnosis);

}  // namespace swarmcert::analysis
