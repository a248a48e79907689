/// @file The set of effects and curves that explains a residual best.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/evidence/detectable.h"
#include "analysis/identification/evidence/hypotheses.h"
#include "analysis/identification/findings.h"

namespace swarmcert::evidence {

/// An effect of the best set.
struct Named {
  identification::Candidate candidate;  ///< with a single theta, the best one
  double evidence_bits = 0;             ///< by which the set loses without it
  double value = 0, deviation = 0;      ///< estimate of the first coefficient, with its standard deviation
  std::vector<identification::Rival> rivals;  ///< effects that flights cannot tell from it
};

struct Explanations {
  std::vector<Named> effects;       ///< in the order of their evidence
  std::vector<std::string> curves;  ///< free curves beside them: "force_z over z"
  bool has_drag_curve = false;      ///< one of them is a force against the velocity
  std::vector<Detectable> detectable;
  /// The data are what set points can have caused. Otherwise a log has none, and the answer of a controller to a
  /// disturbance may look like an effect of thrust or velocity.
  bool is_by_set_points = false;
};

/// Returns the best set of effects and free curves for the residual of all flights of `passes`. Effects of another form
/// than the flights show are left out: those of whose evidence a curve over their own variable, or what turns with the
/// body, has a tenth. The deviations hold for the shape of the single theta.
/// @param all of these flights; shapes off the grid are added, and refuted effects excluded
Explanations explanations(const identification::Passes& passes, Hypotheses& all);

}  // namespace swarmcert::evidence
