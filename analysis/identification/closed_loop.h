/// @file Selection under closed-loop bias: removes effects that only the feedback
/// explains, and groups effects that set points cannot distinguish.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "analysis/identification/instrument.h"

namespace swarmcert::identification {

/// What selection leaves: which effects, with which thetas.
struct Selected {
  Grams grams;
  Members members;
  std::vector<Refined> refined;                        ///< of `members`, in their order
  std::vector<std::vector<InstrumentedValue>> checks;  ///< likewise; empty where there is no check
  std::vector<std::string> contradicted;               ///< what the instrument took out
  /// What could stand in the place of the scale of the thrust, or of the constant force, see without_slope().
  std::string instead;
};

/// Selects on the grid, refines, and selects again with the refined thetas among the others, so that what a coarse
/// theta left does not count as another effect. Effects that the instrument contradicts are taken out.
/// @param names where selection begins
Selected select(const Passes& passes, std::vector<Candidate> candidates,
                const std::vector<std::string>& names = {});

/// As select(), with no scale of the thrust beside a constant vertical force.
///
/// Thrust that answers disturbances gives the force a slope over thrust that is not there, and a constant force beside
/// it the intercept. Where set points do not confirm that slope, flights tell of a scale of the thrust alone or of a
/// constant force alone: the one that leaves less, once the thrust's answer is taken off, and the scale, which is one
/// number, where both leave about the same.
/// The other is Selected::instead where it explains at least half as much: least squares favour neither fairly.
/// @param contradicted begins Selected::contradicted.
Selected without_slope(const Passes& passes, std::vector<Candidate> candidates,
                       std::vector<std::string> contradicted);

/// `effects` for instrument(): the gain of a lag is free, because that is what the check is about.
std::vector<Candidate> candidates_of(const std::vector<Refined>& effects);

/// thrust_ratio or battery: a scale of the thrust.
bool is_scale(const std::string& effect);

/// voltage_sag or thrust_saturation: thrust that is missing where much is asked for.
bool is_of_load(const std::string& effect);

/// True where `effects` have a constant vertical force.
bool has_vertical_push(const std::vector<Refined>& effects);

/// Names of selected effects that are no match for a large unexplained residual, see Diagnosis::suspected.
std::set<std::string> suspects(const Selected& selected);

/// Names of is_of_load() that set points do not confirm: where flights differ in how much thrust the same weight takes,
/// whatever makes them differ looks like thrust that is missing where much is asked for.
std::set<std::string> unconfirmed_loads(const Selected& selected);

/// `names` with those that would only take the place of one that is too doubtful: for a scale one that follows the
/// battery, for a lag or delay the others. What is in `selected` is no substitute.
std::set<std::string> with_substitutes(std::set<std::string> names, const std::vector<Refined>& selected);

/// Takes candidates of these names out.
void erase(std::vector<Candidate>& candidates, const std::set<std::string>& names);

/// Formulas that say what a scale of the thrust beside them says: with an offset, where thrust hardly varies. The
/// number of the scale would be any that the formula then takes back.
std::set<std::string> substitutes_of_scales(const Selected& selected);

}  // namespace swarmcert::identification
