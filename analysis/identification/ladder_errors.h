/// @file Errors by which a ladder decides: of the force, and of the balance of the rotors.
#pragma once

#include <optional>
#include <vector>

#include "analysis/residuals/inputs.h"
#include "stability/model.h"

namespace swarmcert::identification {

/// Squared residual vectors of a flight, in N^2, and their number.
struct FlightSquares {
  double sum = 0, count = 0;
};

/// Returns the squares of the residual of `model` in the flights `which`, in their order.
std::vector<FlightSquares> squares_of(residuals::Inputs inputs, const stability::Model& model,
                                      const std::vector<int>& which, int jobs);

/// Returns the root mean square, in newton.
double rmse_N(const std::vector<FlightSquares>& flights);

/// Whether the error rises in any flight by more than half a percent. A form that only tells flights from each other,
/// such as a step over the battery, lowers the error of some and raises that of others.
bool rises_anywhere(const std::vector<FlightSquares>& before, const std::vector<FlightSquares>& after);

residuals::Inputs only_flights(residuals::Inputs inputs, const std::vector<int>& which);

/// Returns what no model can explain in the flights `which`: the white part of the spectrum.
double noise_floor_N(residuals::Inputs inputs, const stability::Model& model, const std::vector<int>& which,
                     int jobs);

/// Returns how far the rotors are out of balance in the flights `which` with `model`; empty if no flight shows it.
std::optional<double> imbalance_N(const residuals::Inputs& inputs, const stability::Model& model,
                                  const std::vector<int>& which, int jobs);

}  // namespace swarmcert::identification
