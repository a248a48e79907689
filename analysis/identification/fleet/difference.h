/// @file Effects of some flights beyond those of others (flights of the healthy vehicle, or the last release).
///
/// Effects found separately in most days (or flights) of the others are fitted to all of them and held fixed; so is the
/// best formula for the rest, if most of them have a remainder. What the current flights show in addition is the
/// difference. It is compared with the scatter of the same values between the days (or flights) of the others, and
/// reported if it is larger than the differences among them.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/diagnose.h"
#include "analysis/identification/fleet/flight_groups.h"

namespace swarmcert::identification {

/// One vehicle compared with the others.
struct Difference {
  std::string vehicle;
  bool against_itself = false;  ///< the others include flights of this vehicle, and only these are used
  std::vector<stability::EffectSpec> held;  ///< fitted to the others
  std::string grouped_by;                   ///< "folder" or "flight"
  int own_groups = 0, other_groups = 0;     ///< number of groups with enough data for a fit
  /// The differences. The ranking has only those beyond the scatter, which its intervals include.
  Diagnosis diagnosis;
  std::vector<Missing> within_scatter;  ///< found, but within the differences among the others
  std::string no_scatter;               ///< why the scatter is unknown; empty if it is known
};

/// With at least this many folders among the other flights, each folder (day) is a group; otherwise each flight is one.
inline constexpr std::size_t kFewestDays = 3;

/// Compares each vehicle of `kind` in `inputs` with `others`, ordered by name. Vehicles without usable records are
/// skipped. The result does not depend on `jobs`.
/// @param others must have the same models
std::vector<Difference> differences(const residuals::Inputs& inputs, const residuals::Inputs& others,
                                    const std::string& kind, int jobs, const residuals::Progress& progress);

}  // namespace swarmcert::identification
