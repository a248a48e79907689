/// @file Simulated flights for the guides: what 'swarmcert simulate random-walk' writes.
#pragma once

#include <string>

namespace swarmcert::notebook {

/// Simulates random walks with the model in `truth` and writes FOLDER/<run>/cf1_00, cf2_00, ... in the published binary
/// format.
void simulate_flights(const std::string& truth, int vehicles, int runs, double duration_s,
                      const std::string& folder);

}  // namespace swarmcert::notebook
