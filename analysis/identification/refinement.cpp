#include "analysis/identification/refinement.h"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <utility>

#include "analysis/identification/box_least_squares.h"
#include "analysis/identification/covariance.h"
#include "analysis/identification/remainder.h"
#include "analysis/residuals/comparison.h"
#include "analysis/residuals/force_residual.h"
#include "nn/base/parallel.h"

namespace swarmcert::identification {
namespace {

constexpr std::size_t kTooManyToRefine = 400'000;
constexpr int kMostSteps = 7;
constexpr int kStepsOfRefit = 2;        ///< starting close, at the result of the excerpt
constexpr double kDifference = 0.02;    ///< of the scale of a shape, for derivatives
constexpr double kLargestStep = 0.5;    ///< of the scale of a shape
constexpr double kSettled = 0.01;       ///< of the scale of a shape
constexpr double kSettledErrors = 0.1;  ///< of its standard error, if that is larger

/// A number to be fitted: a coefficient or a shape of a member.
struct Unknown {
  std::size_t member;
  bool is_shape;
  std::size_t index;
  double scale;  ///< of shapes
};

/// The members at one set of shapes, with the columns of coefficients and derivatives.
struct Point {
  std::vector<std::vector<double>> thetas;  ///< by member
  std::vector<Block> blocks;                ///< over the unknowns
  Eigen::MatrixXd gram;
  Eigen::VectorXd b, coefficients;  ///< coefficients of the fit with these thetas; 0 for shapes
  double error = 0;                 ///< of that fit
  double equations = 0;
};

double scale_of(const stability::Parameter& parameter, double value) {
  double typical = std::abs(value);
  if (!parameter.grid.empty()) typical = std::max(typical, 0.5 * std::abs(parameter.grid.back()));
  return typical;
}

struct Step {
  std::vector<std::vector<double>> thetas;
  double size;  ///< of the largest change of a shape, relative to a negligible change
};

/// The shapes that a refinement may change.
enum class Moves { kAll, kMemories, kOthers };

class Refinement {
 public:
  explicit Refinement(const Passes& passes) : passes_(passes) {}

  /// @param noise whitens columns and residual; must outlive this object
  Refinement(const Passes& passes, const Noise& noise) : passes_(passes), noise_(&noise) {}

  void add(const Candidate& added, const std::vector<double>& theta, Moves moves) {
    candidates_.push_back(added);
    Candidate& candidate = candidates_.back();
    const std::vector<std::vector<double>> tried = candidate.thetas;
    const std::size_t index = candidates_.size() - 1;
    // Once a lag is identified its gain is fixed to 1; the time constant absorbs what the free gain had explained.
    if (candidate.info.remembers) candidate.info.linear[0].lower = candidate.info.linear[0].upper = 1;
    for (std::size_t c = 0; c < candidate.info.linear.size(); ++c) unknowns_.push_back({index, false, c, 0});
    const bool is_free = moves == Moves::kAll || candidate.info.remembers == (moves == Moves::kMemories);
    for (std::size_t i = 0; is_free && i < theta.size(); ++i) {
      const stability::Parameter& parameter = candidate.info.shape[i];
      const bool varies = !parameter.grid.empty() ||
                          std::any_of(tried.begin(), tried.end(),
                                      [&](const std::vector<double>& other) { return other[i] != theta[i]; });
      const double scale = scale_of(parameter, theta[i]);
      if (varies && scale > 0 && parameter.lower < parameter.upper)
        unknowns_.push_back({index, true, i, scale});
    }
    start_.push_back(theta);
  }

  std::vector<Refined> run(int most_steps = kMostSteps) {
    Point best = evaluate(start_);
    const bool moves =
        std::any_of(unknowns_.begin(), unknowns_.end(), [](const Unknown& u) { return u.is_shape; });
    const int steps = !moves ? 0 : passes_.records > kTooManyToRefine ? 1 : most_steps;
    double radius = kLargestStep;
    std::vector<std::vector<double>> refused;  // a step shorter than the radius is proposed again
    for (int i = 0; i < steps; ++i) {
      const Step next = step(best, radius);
      if (next.size < 1) break;
      if (next.thetas != refused) {
        Point point = evaluate(next.thetas);
        if (point.error < best.error) {
          best = std::move(point);
          continue;
        }
        refused = next.thetas;
      }
      radius *= 0.3;
    }
    return result(best);
  }

 private:
  const stability::Parameter& parameter(const Unknown& u) const {
    const stability::EffectInfo& info = candidates_[u.member].info;
    return u.is_shape ? info.shape[u.index] : info.linear[u.index];
  }

  /// Makes one pass over the flights.
  Point evaluate(const std::vector<std::vector<double>>& thetas) const {
    std::vector<Candidate> around = candidates_;
    const std::vector<double> widths = add_neighbours(thetas, around);
    const Grams full =
        noise_ == nullptr ? block_grams(passes_, around) : whitened_grams(passes_, around, *noise_);
    Members members;
    for (int m = 0; m < static_cast<int>(around.size()); ++m) members.push_back({m, 0});
    const CrossValidation fits(full);
    const Eigen::VectorXd c = fits.coefficients(members), in_model = fits.in_model(members, c);
    Point point;
    point.thetas = thetas;
    const Eigen::MatrixXd mix = mixing(full, around, widths, c, in_model, point);
    const double y = add_blocks(full, mix, point);
    point.error =
        y - 2 * point.coefficients.dot(point.b) + point.coefficients.dot(point.gram * point.coefficients);
    return point;
  }

  /// Gives each member of `around` its shapes, followed by a neighbour for each unknown shape, for finite differences.
  /// @return by unknown: distance of its neighbour, upwards if possible; 0 for coefficients
  std::vector<double> add_neighbours(const std::vector<std::vector<double>>& thetas,
                                     std::vector<Candidate>& around) const {
    std::vector<double> widths(unknowns_.size(), 0);
    for (std::size_t m = 0; m < around.size(); ++m) around[m].thetas = {thetas[m]};
    for (std::size_t k = 0; k < unknowns_.size(); ++k) {
      const Unknown& u = unknowns_[k];
      if (!u.is_shape) continue;
      const double at = thetas[u.member][u.index], h = kDifference * u.scale;
      const double lower = std::max(at - h, parameter(u).lower), upper = std::min(at + h, parameter(u).upper);
      // The wider side is not used: with room on both sides, round-off would decide, differently on other processors.
      const bool has_room_above = at + h <= parameter(u).upper || upper - at >= at - lower;
      const double neighbour = has_room_above ? upper : lower;
      widths[k] = neighbour - at;
      around[u.member].thetas.push_back(thetas[u.member]);
      around[u.member].thetas.back()[u.index] = neighbour;
    }
    return widths;
  }

  /// Returns the column of unknown k as a combination of the columns of `full`; also sets the point's coefficients.
  Eigen::MatrixXd mixing(const Grams& full, const std::vector<Candidate>& around,
                         const std::vector<double>& widths, const Eigen::VectorXd& c,
                         const Eigen::VectorXd& in_model, Point& point) const {
    Eigen::MatrixXd mix = Eigen::MatrixXd::Zero(full.columns, static_cast<Eigen::Index>(unknowns_.size()));
    point.coefficients = Eigen::VectorXd::Zero(mix.cols());
    std::vector<std::size_t> next_theta(around.size(), 1);
    std::vector<Eigen::Index> first_coefficient(around.size(), 0);
    for (std::size_t m = 1; m < around.size(); ++m)
      first_coefficient[m] = first_coefficient[m - 1] + around[m - 1].columns();
    for (std::size_t k = 0; k < unknowns_.size(); ++k) {
      const Unknown& u = unknowns_[k];
      const auto column = static_cast<Eigen::Index>(k);
      const Eigen::Index first = first_coefficient[u.member];
      const std::vector<int>& columns = full.first_column[u.member];
      if (!u.is_shape) {
        point.coefficients[column] = in_model[first + static_cast<Eigen::Index>(u.index)];
        mix(columns[0] + static_cast<int>(u.index), column) = 1;
        continue;
      }
      const int neighbour = columns[next_theta[u.member]++];
      for (int i = 0; i < around[u.member].columns(); ++i) {
        mix(neighbour + i, column) = c[first + i] / widths[k];
        mix(columns[0] + i, column) = -c[first + i] / widths[k];
      }
    }
    std::vector<const Candidate*> effects;
    for (const Candidate& candidate : around) effects.push_back(&candidate);
    for (const ScaledStage& pair : scaled_stages(effects)) {
      for (std::size_t k = 0; k < unknowns_.size(); ++k) {
        if (unknowns_[k].member == pair.scale && !unknowns_[k].is_shape)
          mix(full.first_column[pair.stage][0], static_cast<Eigen::Index>(k)) = 1 / around[pair.stage].scale;
      }
    }
    return mix;
  }

  /// Fills the blocks of the point, their sums and the number of equations.
  /// @return the sum of squares to be explained
  static double add_blocks(const Grams& full, const Eigen::MatrixXd& mix, Point& point) {
    const Eigen::Index n = mix.cols();
    point.gram = Eigen::MatrixXd::Zero(n, n);
    point.b = Eigen::VectorXd::Zero(n);
    double y = 0;
    for (const Block& block : full.blocks) {
      Eigen::MatrixXd dense(full.columns, full.columns);
      for (int j = 0; j < full.columns; ++j) {
        for (int i = 0; i <= j; ++i) dense(i, j) = dense(j, i) = block.gram[Grams::packed(i, j)];
      }
      const Eigen::MatrixXd gram = mix.transpose() * dense * mix;
      Block small;
      small.gram.resize(n * (n + 1) / 2);
      for (Eigen::Index j = 0; j < n; ++j)
        small.gram.segment(j * (j + 1) / 2, j + 1) = gram.col(j).head(j + 1);
      small.b = mix.transpose() * block.b;
      small.follows = block.follows;
      point.gram += gram;
      point.b += small.b;
      y += block.y;
      point.equations += 3.0 * block.records;
      point.blocks.push_back(std::move(small));
    }
    return y;
  }

  /// Returns the inverse prior variance of each shape about its current value, in units of the noise.
  Eigen::VectorXd ridge(const Point& point) const {
    Eigen::VectorXd pull = Eigen::VectorXd::Zero(point.b.size());
    const double variance = point.error / std::max(point.equations, 1.0);
    for (std::size_t k = 0; k < unknowns_.size(); ++k) {
      const double scale = unknowns_[k].scale;
      if (unknowns_[k].is_shape) pull[static_cast<Eigen::Index>(k)] = variance / (scale * scale);
    }
    return pull;
  }

  /// Returns the Gauss-Newton step.
  Step step(const Point& from, double radius) const {
    Eigen::VectorXd lower(from.b.size()), upper = lower;
    for (std::size_t k = 0; k < unknowns_.size(); ++k) {
      const Unknown& u = unknowns_[k];
      const auto i = static_cast<Eigen::Index>(k);
      lower[i] = parameter(u).lower;
      upper[i] = parameter(u).upper;
      if (!u.is_shape) continue;
      const double at = from.thetas[u.member][u.index];
      lower[i] = std::max(lower[i] - at, -radius * u.scale);
      upper[i] = std::min(upper[i] - at, radius * u.scale);
    }
    const Eigen::VectorXd pull = ridge(from);
    Eigen::MatrixXd gram = from.gram;
    gram.diagonal() += pull;
    const Eigen::VectorXd change = box_least_squares(gram, from.b, lower, upper);
    const Eigen::VectorXd variance =
        sandwich(from.blocks, free_unknowns(from, pull), from.coefficients, pull).diagonal();
    Step next = {from.thetas, 0};
    for (std::size_t k = 0; k < unknowns_.size(); ++k) {
      const Unknown& u = unknowns_[k];
      if (!u.is_shape) continue;
      const auto i = static_cast<Eigen::Index>(k);
      double& value = next.thetas[u.member][u.index];
      value = std::clamp(value + change[i], parameter(u).lower, parameter(u).upper);
      const double negligible = std::max(kSettled * u.scale, kSettledErrors * std::sqrt(variance[i]));
      next.size = std::max(next.size, std::abs(change[i]) / negligible);
    }
    return next;
  }

  /// Returns the unknowns that are neither fixed nor at a bound and on which the flights carry information.
  std::vector<int> free_unknowns(const Point& at, const Eigen::VectorXd& pull) const {
    // A shape that changes the forces only by round-off, such as the composition of wakes if there is only one, is
    // entirely unknown: the regularisation alone would make its interval narrow.
    constexpr double kLeastShareOfPull = 1e-6;
    std::vector<int> free;
    for (std::size_t k = 0; k < unknowns_.size(); ++k) {
      const Unknown& u = unknowns_[k];
      const auto i = static_cast<Eigen::Index>(k);
      const double value = u.is_shape ? at.thetas[u.member][u.index] : at.coefficients[i];
      const bool held = parameter(u).lower == parameter(u).upper;
      const bool at_end = u.is_shape && (value <= parameter(u).lower || value >= parameter(u).upper);
      if (!held && !at_end && at.gram(i, i) > kLeastShareOfPull * pull[i])
        free.push_back(static_cast<int>(k));
    }
    return free;
  }

  std::vector<Refined> result(const Point& best) const {
    const Eigen::VectorXd pull = ridge(best);
    const Jackknife spread = jackknife(best.blocks, free_unknowns(best, pull), best.coefficients, pull);
    std::vector<Refined> refined;
    for (std::size_t m = 0; m < candidates_.size(); ++m) {
      refined.push_back({candidates_[m], {}, best.thetas[m], {}, {}});
      refined.back().candidate.thetas = {best.thetas[m]};
      for (const double value : best.thetas[m]) refined.back().shape_intervals.emplace_back(value, value);
    }
    for (std::size_t k = 0; k < unknowns_.size(); ++k) {
      const Unknown& u = unknowns_[k];
      const auto i = static_cast<Eigen::Index>(k);
      Refined& to = refined[u.member];
      const double half = boost::math::quantile(boost::math::students_t(spread.freedom[i]), 0.95) *
                          std::sqrt(spread.variance[i]);
      const double value = u.is_shape ? to.theta[u.index] : best.coefficients[i];
      const Interval interval = {std::max(value - half, parameter(u).lower),
                                 std::min(value + half, parameter(u).upper)};
      if (u.is_shape) {
        to.shape_intervals[u.index] = interval;
      } else {
        to.coefficients.push_back(value);
        to.linear_intervals.push_back(interval);
      }
    }
    return refined;
  }

  const Passes& passes_;
  const Noise* noise_ = nullptr;
  std::vector<Candidate> candidates_;
  std::vector<Unknown> unknowns_;  ///< of each member: first the coefficients, then the shapes
  std::vector<std::vector<double>> start_;
};

/// Returns the vertical residual without a band about `line_hz`, if that is positive.
std::vector<double> vertical_without(double line_hz, const std::vector<Eigen::Vector3d>& residual_N,
                                     const residuals::Track& track) {
  Notch notch(line_hz);
  std::vector<double> vertical;
  for (std::size_t i = 0; i < residual_N.size(); ++i) {
    if (!(line_hz > 0)) {
      vertical.push_back(residual_N[i].z());
      continue;
    }
    const bool restart = i == 0 || track.restarts[i] != 0;
    const double dt_s = restart ? 0 : track.instants[i].time_s - track.instants[i - 1].time_s;
    vertical.push_back(notch.advance(residual_N[i], dt_s, restart)(2, 0));
  }
  return vertical;
}

/// Returns the noise beside `refined`: gusts of the vertical residual, and a line of any axis.
Noise noise_beside(const Passes& passes, const std::vector<Refined>& refined) {
  const residuals::Inputs& inputs = passes.inputs;
  std::vector<stability::EffectSpec> specs;
  for (const Refined& effect : refined) {
    for (stability::EffectSpec& spec : specs_of(effect.candidate, effect.coefficients, effect.theta,
                                                effect.linear_intervals, effect.shape_intervals))
      specs.push_back(std::move(spec));
  }
  const double line_hz = residuals::left_over(inputs_with(passes, specs), passes.jobs).line.frequency_hz;
  std::vector<Autocovariance> parts(passes.flights.size());
  files::parallel_for(static_cast<int>(passes.flights.size()), passes.jobs, [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    std::vector<std::string> problems;
    for (const residuals::Track& track : inputs.load(static_cast<std::size_t>(passes.flights[k]), problems)) {
      if (track.position_only || track.kind != passes.kind || track.instants.size() < 2) continue;
      const stability::Model model = with_effects(inputs.model_for(track), specs);
      const std::vector<double> vertical = vertical_without(
          line_hz, residuals::force_residual(model, inputs.kinds, inputs.rules, track), track);
      const double span_s = track.instants.back().time_s - track.instants.front().time_s;
      const double records_per_s = static_cast<double>(track.instants.size() - 1) / span_s;
      parts[k].add(vertical, {track.restarts.begin(), track.restarts.end()},
                   std::max<std::size_t>(1, std::lround(Autocovariance::kStep_s * records_per_s)));
    }
  });
  Autocovariance sum;
  for (const Autocovariance& part : parts) {
    for (std::size_t k = 0; k < 3; ++k) {
      sum.sums[k] += part.sums[k];
      sum.counts[k] += part.counts[k];
    }
  }
  Noise noise = sum.noise();
  noise.line_hz = line_hz;
  return noise;
}

/// The controller knows the velocity, and thus more about a gust than past residuals show, so part of its reaction is
/// still in the whitened thrust. In simulated flights with gusts of 0.01 and 0.02 N, 0.2 to 0.6 times what whitening
/// had removed was left.
void widen_by_answers(const std::vector<Refined>& by_squares, std::vector<Refined>& whitened) {
  constexpr double kKept = 0.5;
  for (std::size_t i = 0; i < whitened.size(); ++i) {
    const stability::EffectInfo& info = whitened[i].candidate.info;
    if (!info.remembers) continue;
    for (std::size_t k = 0; k < whitened[i].theta.size(); ++k) {
      const double by = kKept * std::abs(by_squares[i].theta[k] - whitened[i].theta[k]);
      Interval& interval = whitened[i].shape_intervals[k];
      interval = {std::max(interval.lower - by, info.shape[k].lower),
                  std::min(interval.upper + by, info.shape[k].upper)};
    }
  }
}

/// Returns half the step between the records of the first flight that has any.
double half_step_s(const Passes& passes) {
  for (const int flight : passes.flights) {
    std::vector<std::string> problems;
    for (const residuals::Track& track : passes.inputs.load(static_cast<std::size_t>(flight), problems)) {
      if (track.position_only || track.kind != passes.kind || track.instants.size() < 2) continue;
      return track.duration_s() / static_cast<double>(track.instants.size() - 1) / 2;
    }
  }
  return 0;
}

/// Fits lags and delays to whitened columns, then everything else beside them to the plain ones.
std::vector<Refined> with_whitened_memories(const Passes& passes, const Noise& noise,
                                            const std::vector<Refined>& refined,
                                            int most_steps = kMostSteps) {
  Refinement of_innovations(passes, noise), of_others(passes);
  for (const Refined& effect : refined) of_innovations.add(effect.candidate, effect.theta, Moves::kMemories);
  const std::vector<Refined> memories = of_innovations.run(most_steps);
  const auto remembers = [&](std::size_t i) { return memories[i].candidate.info.remembers; };
  for (std::size_t i = 0; i < refined.size(); ++i)
    of_others.add(refined[i].candidate, remembers(i) ? memories[i].theta : refined[i].theta, Moves::kOthers);
  std::vector<Refined> result = of_others.run(most_steps);
  for (std::size_t i = 0; i < result.size(); ++i) {
    const std::vector<Interval>& known =
        remembers(i) ? memories[i].shape_intervals : refined[i].shape_intervals;
    for (std::size_t k = 0; k < known.size(); ++k) {  // a shape that was fixed here is known as before
      Interval& interval = result[i].shape_intervals[k];
      if (interval.lower == interval.upper) interval = known[k];
    }
  }
  return result;
}

/// Returns `refined` with the originally free shapes free again.
std::vector<Refined> freed(std::vector<Refined> refined) {
  for (Refined& effect : refined) {
    for (std::size_t k = 0; k < effect.theta.size(); ++k) {
      if (!(effect.shape_intervals[k].lower < effect.shape_intervals[k].upper)) continue;
      effect.candidate.thetas.push_back(effect.theta);
      effect.candidate.thetas.back()[k] += 1;
    }
  }
  return refined;
}

std::vector<Refined> fitted_from(const Passes& passes, const std::vector<Refined>& refined,
                                 int most_steps = kMostSteps) {
  Refinement refinement(passes);
  for (const Refined& effect : refined) refinement.add(effect.candidate, effect.theta, Moves::kAll);
  return refinement.run(most_steps);
}

bool has_memory(const std::vector<Refined>& refined) {
  return std::any_of(refined.begin(), refined.end(),
                     [](const Refined& effect) { return effect.candidate.info.remembers; });
}

}  // namespace

std::vector<Refined> refine(const Passes& passes, const std::vector<Start>& starts) {
  if (starts.empty()) return {};
  Refinement refinement(passes);
  for (const Start& start : starts) refinement.add(start.candidate, start.theta, Moves::kAll);
  return refinement.run();
}

std::vector<Refined> with_innovations(const Passes& passes, std::vector<Refined> refined) {
  constexpr int kMostRounds = 4;  // a wrong lag hides part of the gusts and thus of their correlation
  constexpr double kSettledNoise = 0.05;
  if (!has_memory(refined) || passes.records > kTooManyToRefine) return refined;
  const std::vector<Refined> by_squares = refined;
  Noise before;
  for (int round = 0; round < kMostRounds; ++round) {
    const Noise noise = noise_beside(passes, refined);
    if (noise.is_white()) break;
    if (noise.line_hz == before.line_hz &&
        std::abs(noise.forget_s - before.forget_s) <= kSettledNoise * noise.forget_s &&
        std::abs(noise.white_share - before.white_share) <= kSettledNoise * noise.white_share)
      break;
    refined = with_whitened_memories(passes, noise, refined);
    before = noise;
  }
  widen_by_answers(by_squares, refined);
  return refined;
}

Refined widened_by_step(const Passes& passes, Refined effect) {
  const stability::EffectInfo& info = effect.candidate.info;
  if (!info.remembers || info.traits.place != stability::Place::kThrust) return effect;
  const double by_s = half_step_s(passes);
  for (std::size_t k = 0; k < effect.theta.size(); ++k) {
    Interval& interval = effect.shape_intervals[k];
    if (!(interval.lower < interval.upper)) continue;
    interval = {std::max(interval.lower - by_s, info.shape[k].lower),
                std::min(interval.upper + by_s, info.shape[k].upper)};
  }
  return effect;
}

std::vector<Refined> refit(const Passes& all, const Passes& seen, const std::vector<Refined>& found) {
  const std::vector<Refined> refined = freed(found);
  if (refined.empty()) return {};
  const Noise noise = has_memory(refined) ? noise_beside(seen, refined) : Noise();
  if (noise.is_white()) return fitted_from(all, refined, kStepsOfRefit);
  std::vector<Refined> whitened = with_whitened_memories(all, noise, refined, kStepsOfRefit);
  // The change due to whitening is known well enough from the excerpt.
  std::vector<Refined> by_squares = fitted_from(seen, refined);
  for (std::size_t i = 0; i < whitened.size(); ++i) {
    for (std::size_t k = 0; k < whitened[i].theta.size(); ++k)
      by_squares[i].theta[k] += whitened[i].theta[k] - refined[i].theta[k];
  }
  widen_by_answers(by_squares, whitened);
  return whitened;
}

}  // namespace swarmcert::identification
