/// @file Names of missing effects by evidence.
#pragma once

#include <string>
#include <vector>

#include "analysis/residuals/inputs.h"

namespace swarmcert::evidence {

/// An explanation of the best set.
struct Named {
  std::string name;  ///< of an effect or a curve, see Entry
  bool is_effect = true;
  std::vector<std::string>
      others;  ///< effects that flights cannot tell from it, see EvidenceSearch::instead_of()
  double value = 0, deviation = 0;  ///< estimate of the first coefficient, with its standard deviation
};

/// Returns the best set of explanations of the residual of all flights, by the model of the vehicles of `kind`, in the
/// order in which they were found. The deviations hold for the shape on the grid.
/// @throws std::invalid_argument if a log has no set points, which are the only instruments.
std::vector<Named> names_by_evidence(const residuals::Inputs& inputs, const std::string& kind, int jobs);

}  // namespace swarmcert::evidence
