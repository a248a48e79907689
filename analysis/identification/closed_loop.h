/// @file Selection under closed-loop bias: removes artefacts of feedback, groups indistinguishable effects.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "analysis/identification/instrument.h"

namespace swarmcert::identification {

/// Result of a selection: effects and their thetas.
struct Selected {
  Grams grams;
  Members members;
  std::vector<Refined> refined;                        ///< of `members`, in the same order
  std::vector<std::vector<InstrumentedValue>> checks;  ///< likewise; empty if no check is possible
  std::vector<std::string> contradicted;               ///< effects removed by the instrument
  /// Possible alternative to the thrust scale or the constant force, see without_slope().
  std::string instead;
};

/// Selects on the grid, refines, and selects again with the refined thetas added, so that the error of a coarse theta
/// is not attributed to another effect. Effects that the instrument contradicts are removed.
/// @param names effects with which the selection begins
Selected select(const Passes& passes, std::vector<Candidate> candidates,
                const std::vector<std::string>& names = {});

/// Like select(), but never combines a thrust scale with a constant vertical force.
///
/// Thrust that reacts to disturbances creates an apparent slope of the force over the thrust, and a constant force
/// beside it absorbs the intercept. If setpoints do not confirm the slope, either a thrust scale or a constant force is
/// selected: the one with the smaller error after the reaction of the thrust is removed, or the scale, which has a
/// single coefficient, if both errors are about equal. The other one becomes Selected::instead if it explains at least
/// half as much, as least squares are biased in both cases.
/// @param contradicted initial entries of Selected::contradicted
Selected without_slope(const Passes& passes, std::vector<Candidate> candidates,
                       std::vector<std::string> contradicted);

/// Returns `effects` as candidates for instrument(): the gain of a lag is free, because it is what the check is about.
std::vector<Candidate> candidates_of(const std::vector<Refined>& effects);

/// Returns whether an effect is a fraction of the thrust, or a constant force.
bool is_scale(const std::string& effect);
bool is_push(const std::string& effect);

/// Returns whether an effect needs confirmation by setpoints: thrust, which reacts to all disturbances, or its history
/// enters it.
bool is_of_thrust(const stability::EffectInfo& info);

/// Returns true if `effects` include a constant vertical force.
bool has_vertical_push(const std::vector<Refined>& effects);

/// Returns the names of selected effects that are too small beside a large unexplained residual, see
/// Diagnosis::suspected.
std::set<std::string> suspects(const Selected& selected);

/// Returns the names of effects that setpoints must always confirm, and do not: if the thrust needed to carry the
/// weight differs between flights for any reason, that looks like a loss of high thrust.
std::set<std::string> unconfirmed_loads(const Selected& selected);

/// Returns `names` plus those effects that would merely replace a doubtful one: for a scale the scales that vary,
/// for a lag or delay the other lags and delays. Effects in `selected` are not added.
std::set<std::string> with_substitutes(std::set<std::string> names, const std::vector<Refined>& selected);

/// Removes candidates with these names.
void erase(std::vector<Candidate>& candidates, const std::set<std::string>& names);

/// Returns the formulas that, with an offset, are equivalent to a thrust scale beside them because the thrust hardly
/// varies. The coefficient of the scale would be arbitrary, since the formula could compensate for it.
std::set<std::string> substitutes_of_scales(const Selected& selected);

}  // namespace swarmcert::identification
