/// @file What changed: effects of some flights beyond those of others (the healthy vehicle, the last release).
///
/// Effects that most days, or flights, of the others show by themselves are fitted to all of them and held, and so is
/// the best formula for what these leave, where most leave something.
/// What the flights at hand show on top is the difference. It is judged against the scatter of the same numbers between
/// the days, or flights, of the others: a difference counts if it is larger than they differ among themselves.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/diagnose.h"
#include "analysis/identification/fleet/flight_groups.h"

namespace swarmcert::identification {

/// One vehicle against the others.
struct Difference {
  std::string vehicle;
  bool against_itself = false;              ///< the others hold flights of this vehicle, and only these count
  std::vector<stability::EffectSpec> held;  ///< fitted to the others
  std::string grouped_by;                   ///< "folder" or "flight"
  int own_groups = 0, other_groups = 0;     ///< with enough data for a fit
  /// What differs: intervals of its ranking hold the scatter. The ranking has only what is beyond it.
  Diagnosis diagnosis;
  std::vector<Missing> within_scatter;  ///< found, but no larger than the others differ among themselves
  std::string no_scatter;               ///< why the scatter is not known; empty where it is
};

/// With at least this many folders among the other flights, each folder (day) is a group; otherwise each flight is one.
inline constexpr std::size_t kFewestDays = 3;

/// Every vehicle of `kind` in `inputs` against `others`, in order of their names. Vehicles without usable records are
/// left out. Neither depends on `jobs`.
/// @param others of the same models.
std::vector<Difference> differences(const residuals::Inputs& inputs, const residuals::Inputs& others,
                                    const std::string& kind, int jobs, const residuals::Progress& progress);

}  // namespace swarmcert::identification
