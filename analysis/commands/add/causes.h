/// @file What a ladder added to a model, cause by cause: equation, size, and by how much the error fell.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "analysis/commands/shared/effect_output.h"
#include "analysis/identification/ladder.h"
#include "analysis/residuals/force_unit.h"

namespace swarmcert::analysis {

struct CauseMeasure {
  std::string quantity, unit;
  double before = 0, after = 0;
};
void describe(files::Record& record, const CauseMeasure& measure);

struct Cause {
  std::string name;
  std::string equation;     ///< of the force, or of what it changes; parameters by name
  FittedValues parameters;  ///< units stand in the names
  /// RMSE of the residual vector before and after, on flights that decided nothing; if nothing was held out, on those
  /// of the fit.
  double before_N = 0, after_N = 0;
  /// What decided instead, on the same flights; absent: the residual did.
  std::optional<CauseMeasure> measure;

  double fall_percent() const {
    const double before = measure ? measure->before : before_N, after = measure ? measure->after : after_N;
    return before > 0 ? 100 * (1 - after / before) : 0;
  }
};
void describe(files::Record& record, const Cause& cause);

/// Returns the accepted effects, formulas and shapes of `ladder`, in the order in which they were accepted.
std::vector<Cause> causes_of(const identification::Ladder& ladder);

/// Returns the cause with its fitted values and 90 % intervals: "drag_linear: a drag of 0.021 N s/m times
/// the velocity; drag_N_s_m = 0.021 (0.019 .. 0.023); lowers the error by 12 %, 8.1 to 7.1 mN". The equation is not
/// part of it.
std::string sentence(const Cause& cause, const residuals::ForceUnit& unit);

/// Returns on what the errors of causes were measured: "flights that nothing was fitted to".
std::string where_held_out(const identification::Ladder& ladder);

}  // namespace swarmcert::analysis
