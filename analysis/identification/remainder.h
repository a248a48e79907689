/// @file The residual that no effect of the library explains.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/refinement.h"
#include "analysis/residuals/statistics.h"

namespace swarmcert::identification {

/// Returns the inputs with only the flights of `passes` and with `specs` added to their models.
residuals::Inputs inputs_with(const Passes& passes, const std::vector<stability::EffectSpec>& specs);

struct Remainder {
  bool flag = false;
  double ratio = 0;     ///< maximum over the axes of Spectrum::low_band_to_floor(); 0 if there is no spectrum
  double floor_N2 = 0;  ///< mean square of the noise floor
  double excess_N2 = 0;                 ///< mean square of the force vector above the noise floor
  residuals::SpectralLine line;         ///< a vibration
  std::vector<std::string> depends_on;  ///< "vibration", and variables over which its mean varies most

  /// Returns whether the spectrum has slow disturbances or a vibration.
  bool stands_out() const { return flag || line.is_found(); }
};

/// Returns the remainder of the models with `specs` added. It is flagged if its low frequencies exceed three times the
/// noise floor (correct models of 54 simulations stayed below 2.4).
Remainder remainder(const Passes& passes, const std::vector<stability::EffectSpec>& specs);

}  // namespace swarmcert::identification
