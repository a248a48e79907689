#include "analysis/identification/closed_loop.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <string_view>

#include "analysis/identification/scan/formulas.h"
#include "nn/base/text.h"
#include "stability/effects/registry.h"

namespace swarmcert::identification {
namespace {

using stability::Family;

/// With more records, thetas off the grid are not used in a second selection.
constexpr std::size_t kManyRecords = 400'000;

/// Returns true for a lag or delay that removes little, and for which the setpoints, although too weak to determine its
/// size, show nothing and significantly less than least squares: thrust that reacts to disturbances looks like a lag.
bool is_unseen_lag(const Refined& refined, const InstrumentedValue& check, double loss) {
  constexpr double kLittle = 0.1, kBeyondChance_z = 2;
  return refined.candidate.info.remembers && loss < kLittle && check.difference_z < -kBeyondChance_z &&
         check.interval.lower <= 0;
}

/// Returns the index of the first effect that is only an artefact of the controller's reaction; -1 if none.
int contradicted(const Selection& selection, const Members& members, const std::vector<Refined>& refined,
                 const std::vector<std::vector<InstrumentedValue>>& checks) {
  for (std::size_t i = 0; i < checks.size(); ++i) {
    if (refined[i].candidate.columns() != 1) continue;
    if (checks[i][0].contradicts() ||
        is_unseen_lag(refined[i], checks[i][0], selection.loss_without(members, i)))
      return static_cast<int>(i);
  }
  return -1;
}

/// Returns true if a thrust scale is selected beside a constant vertical force and the setpoints do not confirm the
/// least squares estimate.
bool has_doubtful_slope(const std::vector<Refined>& refined,
                        const std::vector<std::vector<InstrumentedValue>>& checks) {
  constexpr double kSurely_z = 3;
  if (!has_vertical_push(refined)) return false;
  for (std::size_t i = 0; i < refined.size(); ++i) {
    if (!is_scale(refined[i].candidate.name)) continue;
    if (checks.empty() || !checks[i][0].is_strong() || std::abs(checks[i][0].difference_z) > kSurely_z)
      return true;
  }
  return false;
}

bool is_vertical_push(const stability::Parameter& parameter) {
  return files::ends_with(parameter.name, "force_z_N");
}

/// Removes the vertical component from the constant forces of `candidates`.
void hold_vertical_push(std::vector<Candidate>& candidates) {
  for (Candidate& candidate : candidates) {
    if (!is_push(candidate.name)) continue;
    for (stability::Parameter& parameter : candidate.info.linear) {
      if (is_vertical_push(parameter)) parameter.lower = parameter.upper = 0;
    }
  }
}

/// Returns true if the instrument confirms the effect's coefficient.
bool is_confirmed(const std::vector<InstrumentedValue>& check) {
  constexpr double kAlike = 0.25;
  return std::all_of(check.begin(), check.end(), [](const InstrumentedValue& value) {
    return value.is_strong() &&
           std::abs(value.instrument - value.least_squares) <= kAlike * std::abs(value.least_squares);
  });
}

}  // namespace

void erase(std::vector<Candidate>& candidates, const std::set<std::string>& names) {
  candidates.erase(std::remove_if(candidates.begin(), candidates.end(),
                                  [&](const Candidate& c) { return names.count(c.name) == 1; }),
                   candidates.end());
}

bool is_scale(const std::string& effect) {
  return stability::traits_of(effect).family == Family::kThrustScale;
}

bool is_push(const std::string& effect) { return stability::traits_of(effect).family == Family::kPush; }

bool is_of_thrust(const stability::EffectInfo& info) {
  return info.remembers || info.traits.set_points != stability::SetPoints::kNotNeeded;
}

bool has_vertical_push(const std::vector<Refined>& effects) {
  return std::any_of(effects.begin(), effects.end(), [](const Refined& effect) {
    const std::vector<stability::Parameter>& linear = effect.candidate.info.linear;
    return is_push(effect.candidate.name) &&
           std::any_of(linear.begin(), linear.end(), [](const stability::Parameter& parameter) {
             return is_vertical_push(parameter) && !is_held_at_zero(parameter);
           });
  });
}

std::vector<Candidate> candidates_of(const std::vector<Refined>& effects) {
  std::vector<Candidate> candidates;
  for (const Refined& r : effects) {
    candidates.push_back(r.candidate);
    if (r.candidate.info.remembers) candidates.back().info.linear[0].lower = 0;
  }
  return candidates;
}

Selected select(const Passes& passes, std::vector<Candidate> candidates,
                const std::vector<std::string>& names) {
  constexpr int kMostRounds = 6;
  Selected result;
  std::set<std::string> named;
  for (int round = 0; round < kMostRounds; ++round) {
    result.grams = block_grams(passes, candidates, Kept::kYes);
    const Selection selection(result.grams);
    if (!selection.is_sound()) return result;
    result.members = selection.select(names);
    result.refined = refine(passes, result.grams, result.members);
    result.checks = instrument(passes, candidates_of(result.refined));
    if (const int bad = contradicted(selection, result.members, result.refined, result.checks); bad >= 0) {
      const std::string& name = result.refined[static_cast<std::size_t>(bad)].candidate.name;
      const bool is_slope = is_scale(name) && has_vertical_push(result.refined);
      if (is_slope) return without_slope(passes, std::move(candidates), result.contradicted);
      result.contradicted.push_back(name);
      erase(candidates, {name});
      continue;
    }
    if (has_doubtful_slope(result.refined, result.checks))
      return without_slope(passes, std::move(candidates), result.contradicted);
    std::set<std::string> now;
    bool moved = false;
    for (std::size_t i = 0; i < result.members.size(); ++i) {
      const Refined& refined = result.refined[i];
      now.insert(refined.candidate.name);
      Candidate& candidate = candidates[static_cast<std::size_t>(result.members[i].candidate)];
      if (std::find(candidate.thetas.begin(), candidate.thetas.end(), refined.theta) ==
          candidate.thetas.end()) {
        candidate.thetas.push_back(refined.theta);
        ++candidate.refined_thetas;
        moved = true;
      }
    }
    if (!moved || now == named || passes.records > kManyRecords) break;
    named = now;
  }
  widen_by_bias(result.checks, instrument_with_shapes(passes, result.refined), result.refined);
  return result;
}

/// Returns the ratio of the mean square left by a thrust scale to that left by a constant force if the thrust reacts to
/// the whole remainder; it is the same whichever of the two is true. A disturbance d beside a constant force F makes
/// the thrust T = m g - F - d; the scale 1 + e that equals F on average leaves F + d - e T = (1 + e) d. At least 1: if
/// both leave the same, the scale is chosen.
double feedback_share(const Selected& scale) {
  for (const Refined& effect : scale.refined) {
    if (!effect.candidate.info.traits.is_plain(Family::kThrustScale)) continue;
    const double factor = 1 + effect.coefficients[0];
    return std::max(factor * factor, 1.0);
  }
  return 1;
}

Selected without_slope(const Passes& passes, std::vector<Candidate> candidates,
                       std::vector<std::string> contradicted) {
  constexpr double kShare = 0.5;
  const double alike = 1 + Thresholds().gain;
  std::vector<Candidate> one = candidates;
  hold_vertical_push(one);
  Selected scale = select(passes, std::move(one));
  candidates.erase(std::remove_if(candidates.begin(), candidates.end(),
                                  [](const Candidate& c) { return is_scale(c.name); }),
                   candidates.end());
  Selected push = select(passes, std::move(candidates));
  const auto left = [](const Selected& s) { return Selection(s.grams).mean_square(s.members); };
  const auto has = [](const Selected& s, const auto& is_one) {
    return std::any_of(s.refined.begin(), s.refined.end(),
                       [&](const Refined& effect) { return is_one(effect.candidate.name); });
  };
  const bool has_scale = has(scale, is_scale), has_push = has(push, is_push);
  const std::string plain_scale = stability::plain_effect(Family::kThrustScale);
  const bool takes_scale = has_scale && left(scale) <= alike * feedback_share(scale) * left(push);
  if (takes_scale) {
    scale.instead = stability::plain_effect(Family::kPush);
  } else {
    const double none = Selection(push.grams).mean_square({});
    if (has_scale && has_push && none - left(scale) > kShare * (none - left(push)))
      push.instead = plain_scale;
    else
      contradicted.push_back(plain_scale);
  }
  Selected result = takes_scale ? std::move(scale) : std::move(push);
  contradicted.insert(contradicted.end(), result.contradicted.begin(), result.contradicted.end());
  result.contradicted = std::move(contradicted);
  return result;
}

std::set<std::string> suspects(const Selected& selected) {
  constexpr double kShare = 0.1;
  // An effect that removes three quarters of the mean square is not part of the remaining quarter.
  constexpr double kPlain = 0.75;
  const Selection selection(selected.grams);
  std::set<std::string> names;
  for (std::size_t i = 0; i < selected.members.size(); ++i) {
    const Candidate& candidate = selected.refined[i].candidate;
    const double loss = selection.loss_without(selected.members, i);
    if (loss >= kPlain) continue;
    // Without setpoints a lag can be confirmed only by its size. A scale has its rivals, see without_slope().
    const bool has_check = !selected.checks.empty();
    const bool unconfirmed = is_of_thrust(candidate.info) &&
                             (has_check ? !is_confirmed(selected.checks[i]) : !candidate.info.remembers);
    if (loss < kShare || unconfirmed) names.insert(candidate.name);
  }
  return names;
}

std::set<std::string> unconfirmed_loads(const Selected& selected) {
  std::set<std::string> names;
  for (std::size_t i = 0; i < selected.refined.size(); ++i) {
    const Candidate& candidate = selected.refined[i].candidate;
    if (candidate.info.traits.set_points == stability::SetPoints::kAlways &&
        (selected.checks.empty() || !is_confirmed(selected.checks[i])))
      names.insert(candidate.name);
  }
  return names;
}

std::set<std::string> with_substitutes(std::set<std::string> names, const std::vector<Refined>& selected) {
  std::set<std::string> substitutes;
  for (const std::string& name : names) {
    const Family family = stability::traits_of(name).family;
    const bool is_answer = family == Family::kThrustScale || family == Family::kLate;
    if (!is_answer || !stability::traits_of(name).is_plain(family)) continue;
    for (const std::string& other : stability::effect_names()) {
      if (stability::traits_of(other).family == family) substitutes.insert(other);
    }
  }
  for (const Refined& effect : selected) substitutes.erase(effect.candidate.name);
  names.merge(substitutes);
  return names;
}

std::set<std::string> substitutes_of_scales(const Selected& selected) {
  constexpr double kAlike = 0.9;  // of the squared norm of the scale's column
  const Grams& grams = selected.grams;
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(Eigen::Index(grams.columns) * (grams.columns + 1) / 2);
  for (const Block& block : grams.blocks) sum += block.gram;
  const auto columns_of_member = [&](const Member& member) {
    const auto k = static_cast<std::size_t>(member.candidate), t = static_cast<std::size_t>(member.theta);
    std::vector<int> columns;
    for (int c = 0; c < grams.candidates[k].columns(); ++c) columns.push_back(grams.first_column[k][t] + c);
    return columns;
  };
  const auto name_of = [&](const Member& member) {
    return grams.candidates[static_cast<std::size_t>(member.candidate)].name;
  };
  std::set<std::string> names;
  for (const Member& scale : selected.members) {
    if (!is_scale(name_of(scale))) continue;
    const int at = columns_of_member(scale)[0];
    for (const Member& formula : selected.members) {
      if (!is_formula(name_of(formula))) continue;
      const std::vector<int> columns = columns_of_member(formula);
      Eigen::VectorXd along(static_cast<Eigen::Index>(columns.size()));
      for (std::size_t c = 0; c < columns.size(); ++c)
        along[static_cast<Eigen::Index>(c)] = sum[Grams::packed(columns[c], at)];
      const Eigen::MatrixXd gram = part_of_gram(sum, columns);
      const double shared = along.dot(gram.completeOrthogonalDecomposition().solve(along));
      if (shared > kAlike * sum[Grams::packed(at, at)]) names.insert(name_of(formula));
    }
  }
  return names;
}

}  // namespace swarmcert::identification
