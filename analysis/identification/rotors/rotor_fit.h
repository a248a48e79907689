/// @file Factors of the four rotors from slow flight, as the effect `rotor_thrust` has them.
///
/// In slow flight the torques cancel, so that the four rotors give the same force each, whatever the map says of their
/// duties: f_k = total / 4, and rotor_k = total / 4 / mapped_k. A centre of mass that sits elsewhere looks the same, as
/// in rotor_balance.h: the factors are those of rotors about a centre of mass in the middle.
#pragma once

#include <array>

#include "analysis/identification/diagnose.h"
#include "analysis/identification/rotors/rotor_balance.h"

namespace swarmcert::identification {

using RotorFactors = std::array<RotorFactor, 4>;

/// Of one flight, beside a scale that all rotors share: total = sum of mapped_k. The intervals are of this flight, from
/// the scatter of its blocks.
RotorFactors rotor_factors(const RotorLoads& flight);

/// Of several flights, not empty. `scale` is what the sum of the true forces is of the sum of the mapped ones, per
/// flight in their order. Intervals hold the scatter between the flights; of one flight, what the battery's place does.
RotorFactors rotor_factors(const std::vector<RotorLoads>& flights, const std::vector<double>& scale,
                           const stability::Model& model);

/// Root mean square over flights and rotors of how far f_k = factor_k mapped_k is from total / 4.
double rotor_imbalance_N(const std::vector<RotorLoads>& flights, const RotorFactors& factors);

/// rotor_thrust for the model of `kind`, fitted to the flights `which`. The true forces carry the weight, less what the
/// model's own thrust_ratio gives. Empty where no flight has three seconds of slow flight with four duties.
std::vector<Missing> fit_rotors(const residuals::Inputs& inputs, const std::string& kind,
                                const std::vector<int>& which, int jobs);

/// The factors that `model` has; 1 where it has none.
RotorFactors rotor_factors_of(const stability::Model& model);

}  // namespace swarmcert::identification
