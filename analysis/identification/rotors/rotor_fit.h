/// @file Factors of the four rotors from slow flight, as used by the effect `rotor_thrust`.
///
/// In slow flight the torques cancel, so the four rotors give equal forces, whatever the thrust map predicts from their
/// duties: f_k = total / 4, and rotor_k = total / 4 / mapped_k. An offset centre of mass looks the same, as in
/// rotor_balance.h: the factors assume a centre of mass in the middle.
#pragma once

#include <array>

#include "analysis/identification/diagnose.h"
#include "analysis/identification/rotors/rotor_balance.h"

namespace swarmcert::identification {

using RotorFactors = std::array<RotorFactor, 4>;

/// Returns the factors of one flight relative to a scale shared by all rotors: total = sum of mapped_k. The intervals
/// are for this flight, from the scatter of its blocks.
RotorFactors rotor_factors(const RotorLoads& flight);

/// Returns the factors of one or more flights. `scale` is the sum of the true forces divided by the sum of the mapped
/// forces, per flight in the same order. The intervals include the scatter between flights; for a single flight, the
/// effect of the battery's position.
RotorFactors rotor_factors(const std::vector<RotorLoads>& flights, const std::vector<double>& scale,
                           const stability::Model& model);

/// Returns the root mean square over flights and rotors of f_k - total / 4 with f_k = factor_k mapped_k.
double rotor_imbalance_N(const std::vector<RotorLoads>& flights, const RotorFactors& factors);

/// Returns rotor_thrust for the model of `kind`, fitted to the flights `which`. The true forces carry the weight,
/// reduced by the model's own thrust_ratio. Empty if no flight has three seconds of slow flight with the forces of four
/// rotors.
std::vector<Missing> fit_rotors(const residuals::Inputs& inputs, const std::string& kind,
                                const std::vector<int>& which, int jobs);

/// Returns the factors in `model`; 1 if it has none.
RotorFactors rotor_factors_of(const stability::Model& model);

}  // namespace swarmcert::identification
