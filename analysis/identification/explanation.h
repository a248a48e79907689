/// @file Names for what the model leaves, where they do as well as formulas, and what is left beside them.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "analysis/identification/missing.h"
#include "analysis/identification/remainder.h"
#include "analysis/identification/scan/formulas.h"
#include "analysis/identification/scan/scan.h"

namespace swarmcert::identification {

/// Remainder::ratio from which on small effects cannot be told from parts of what no effect explains. Source: 20
/// simulated flights in gusts and foreign forces had 56 .. 320, recorded flights of two vehicles 9 .. 21.
inline constexpr double kLoudRatio = 25;

/// What is selected once nothing of it is suspect.
struct Settled {
  Selected selected;
  std::vector<Missing> ranking;
  Remainder rest;
  std::vector<std::string> suspected;
};

/// Names that stand against formulas, and what is left beside them.
struct Explained {
  Settled settled;
  Scan scan;
  std::vector<Formula> formulas;
};

/// Selects effects for the residual of the flights of `passes`. A name stands only if it explains about as much as the
/// best formula would in its place, and is a match for what is left beside it: where the remainder stands out by more
/// than kLoudRatio, an effect counts only if it takes a tenth of the mean square, and one of the thrust only if set
/// points confirm its size; where it stands out at all, a force of a place or a share of the thrust below two percent
/// of the weight only if it takes more than what is left above the noise.
Explained explain(const Passes& passes, const Coverage& covered);

/// Numbers, intervals and errors of the names of `explained`, which the flights of `seen` gave, from all flights:
/// `seen` is an excerpt of those of `all`. What rivals say stays.
/// @return the cross-validated mean square over all flights without the names, and with them; N^2. Nothing, and nothing
/// is changed, where a name has no fit of its own.
std::optional<std::pair<double, double>> fit_to_all(const Passes& all, const Passes& seen,
                                                    Explained& explained);

}  // namespace swarmcert::identification
