/// @file Chooses named effects that explain the residual as well as formulas do, and what remains beside them.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "analysis/identification/evidence/detectable.h"
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
  std::vector<evidence::Detectable> detectable;
  std::set<std::string> at_bound;  ///< of those: not identified, because a value ended at its bound
};

/// Named effects that hold against formulas, and the remainder beside them.
struct Explained {
  Settled settled;
  Scan scan;
  std::vector<Formula> formulas;
  /// A drag of no fixed exponent is part of the remainder.
  bool has_drag_law = false;
  bool has_curves = false;  ///< free curves explain part of the residual
};

/// Names the effects that explain the residual of the flights of `passes` best (evidence/explanations.h), without those
/// that end at a bound, that do not lower the error of held-out blocks, or beside which the residual still varies with
/// their own variable.
Explained explain(const Passes& passes, const Coverage& covered);

/// Recomputes values, intervals and errors of the effects of `explained`, which were found on the excerpt `seen` of the
/// flights of `all`, from all flights. The rivals are kept.
/// @return the cross-validated mean square over all flights without and with the effects, N^2; nothing, leaving
///   `explained` unchanged, if an effect has no fit of its own
std::optional<std::pair<double, double>> fit_to_all(const Passes& all, const Passes& seen,
                                                    Explained& explained);

}  // namespace swarmcert::identification
