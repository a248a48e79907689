/// @file A diagnosis as JSON and as text.
#pragma once

#include <vector>

#include "analysis/identification/diagnose.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {

/// Text for people, of one kind of vehicle.
void print_diagnosis(const identification::Diagnosis& diagnosis);

/// `verdict`, `ranking`, `unexplained`, `remainder`, `detectable`, `kinds`, `problems` and, where the verdict is
/// inconclusive, `reason`; forces in newton.
void add_diagnoses(const std::vector<identification::Diagnosis>& diagnoses, files::Json& result);

}  // namespace swarmcert::analysis
