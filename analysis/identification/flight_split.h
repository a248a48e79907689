/// @file Which flights, or parts of flights, fit, select and test.
#pragma once

#include <vector>

#include "analysis/residuals/inputs.h"

namespace swarmcert::identification {

/// The use of each flight. Split by flight if there are at least three; never record by record, because neighbouring
/// records are similar.
struct Split {
  /// kTime: parts of flights with a guard between them. kNothing: too little even for that; all is used for everything.
  enum class By { kFlights, kTime, kNothing };
  By by = By::kFlights;
  std::vector<int> fit, select, test;
};

/// Of each five flights, ordered by scenario and run, uses three to fit, one to select and one to test; of three or
/// four flights, the last one to test and the one before it to select. Fewer flights are replaced in `inputs` by their
/// parts, five of at least 8 s each, and the parts are split in the same way.
Split split_flights(residuals::Inputs& inputs);

}  // namespace swarmcert::identification
