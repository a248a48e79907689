/// @file Chooses named effects that explain the residual as well as formulas do, and what remains beside them.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "analysis/identification/missing.h"
#include "analysis/identification/remainder.h"
#include "analysis/identification/scan/formulas.h"
#include "analysis/identification/scan/scan.h"

namespace swarmcert::identification {

/// A selection without suspect effects.
struct Settled {
  Selected selected;
  std::vector<Missing> ranking;
  Remainder rest;
  std::vector<std::string> suspected;
  std::set<std::string> at_bound;  ///< of those: not identified, because a value ended at its bound
};

/// Named effects that hold against formulas, and the remainder beside them.
struct Explained {
  Settled settled;
  Scan scan;
  std::vector<Formula> formulas;
  /// A drag with a free exponent replaces named drags. It is part of the remainder.
  bool has_drag_law = false;
};

/// Selects effects for the residual of the flights of `passes`. A named effect is accepted only if it explains about as
/// much as the best formula would in its place and is not too small beside the remainder. If the ratio of the remainder
/// exceeds kLoudRatio, an effect must remove a tenth of the mean square, and setpoints must confirm the size of an
/// effect of the thrust. If the remainder stands out at all, a position-dependent force, or a fraction of the thrust
/// below two percent of the weight, must remove more than what is left above the noise.
Explained explain(const Passes& passes, const Coverage& covered);

/// Recomputes values, intervals and errors of the effects of `explained`, which were found on the excerpt `seen` of the
/// flights of `all`, from all flights. The rivals are kept.
/// @return the cross-validated mean square over all flights without and with the effects, N^2; nothing, leaving
///   `explained` unchanged, if an effect has no fit of its own
std::optional<std::pair<double, double>> fit_to_all(const Passes& all, const Passes& seen,
                                                    Explained& explained);

}  // namespace swarmcert::identification
