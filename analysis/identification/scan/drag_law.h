/// @file Drag as a power of the speed, against which the exponents of the named drags are judged.
#pragma once

#include <optional>
#include <vector>

#include "analysis/identification/scan/formulas.h"

namespace swarmcert::identification {

/// The coefficients of the drags whose exponents are fixed: the forces -linear v and -quadratic |v| v.
struct FixedDrag {
  double linear_N_s_m = 0, quadratic_N_s2_m2 = 0;
};

/// A force -a |v|^exponent against the velocity, with a in newton at 1 m/s, as an effect in `formula`.
struct DragLaw {
  Formula formula;
  double exponent = 0;
  double mean_square_N2 = 0;  ///< of the residual beside the law, of means over 0.1 s
};

/// Returns the drag law with the least mean square, a least-squares estimate, for the residual of a model.
/// @param beside drags that the model of `samples` has and that the law replaces
/// @return nothing if the force does not oppose the velocity, or if no exponent between 0.3 and 4.7 is best
std::optional<DragLaw> drag_law(const ScanSamples& samples, const FixedDrag& beside);

/// Puts the drag law before `formulas` if it explains a larger share of the residual than each of them.
void prefer_drag_law(const ScanSamples& samples, std::vector<Formula>& formulas);

/// Returns the mean square of the residual force, N^2, of means over 0.1 s.
double mean_square_N2(const ScanSamples& samples);

/// The name of the effect of drag_law().
inline constexpr char kDragLaw[] = "formula_power_of_speed";

}  // namespace swarmcert::identification
