/// @file The residual that no effect of the library explains.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/refinement.h"

namespace swarmcert::identification {

/// The flights of `passes` alone, and their models with `specs` as well.
residuals::Inputs inputs_with(const Passes& passes, const std::vector<stability::EffectSpec>& specs);

struct Remainder {
  bool flag = false;
  double ratio = 0;  ///< largest over the axes of Spectrum::low_band_to_floor(); 0 where there is no spectrum
  double excess_N2 = 0;                 ///< mean square above the noise floor, of the force's vector
  std::vector<std::string> depends_on;  ///< variables over which its mean varies most
};

/// The remainder that the flights' models leave once they have `specs` as well: flagged where its low frequencies stand
/// out three times above the noise floor (correct models of 54 simulations stayed below 2.4).
Remainder remainder(const Passes& passes, const std::vector<stability::EffectSpec>& specs);

}  // namespace swarmcert::identification
