/// @file A diagnosis as JSON and as text.
#pragma once

#include <vector>

#include "analysis/identification/diagnose.h"
#include "analysis/identification/fleet/difference.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {

/// Text for people, of one kind of vehicle.
void print_diagnosis(const identification::Diagnosis& diagnosis);

/// `verdict`, `ranking`, `unexplained`, `remainder`, `detectable`, `kinds`, `problems` and, where the verdict is
/// inconclusive, `reason`; forces in newton.
void add_diagnoses(const std::vector<identification::Diagnosis>& diagnoses, files::Json& result);

/// `against`: per vehicle what was held, how its scatter is known, and what was found within it.
void add_differences(const std::vector<identification::Difference>& differences,
                     const std::vector<std::string>& other_flights, files::Json& result);

/// What the ranking of `difference` rests on, for people.
std::string in_words(const identification::Difference& difference);

/// Flights that would answer what these leave open, best first: of the rivals of each effect, then of effects that
/// these flights could not have shown at any size.
std::vector<std::string> next_flights(const identification::Diagnosis& diagnosis);

}  // namespace swarmcert::analysis
