#include "analysis/tracking/tube/least_tube.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

namespace swarmcert::analysis {
namespace {

constexpr int kMostTrials = 14;
constexpr int kMostSteps = 80;
/// Relative and absolute (m or m/s) margin of the proved tube over the fixed point.
constexpr double kRelative = 1e-3, kAbsolute = 1e-7;
/// Stops when the last round improved the tube by less than this, relatively.
constexpr double kWorthwhile = 0.01;

/// A tube for which the bounds are prepared.
class Trial {
 public:
  Trial(const Scene& scene, const ForceBound& bound, const Radii& largest, std::vector<TruthSizes> truth)
      : scene_(scene), bound_(bound), largest_(largest), truth_(std::move(truth)) {
    for (int i = 0; i < scene.vehicles(); ++i) others_.push_back(scene.other_errors(i, truth_));
  }

  /// B(r), for r within the prepared tube.
  Radii allowed(const Radii& radii) const {
    const std::vector<double> force_N = bound_.sizes(radii);
    Radii result = Radii::none(scene_.vehicles());
    for (int i = 0; i < scene_.vehicles(); ++i) {
      const auto at = static_cast<std::size_t>(i);
      const std::array<ErrorHistory, 3>& other = others_[at];
      const std::array<ErrorHistory, 3> hold = scene_.hold_errors(i, radii, force_N, truth_);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        ErrorHistory history = axis == 2 ? scene_.errors_z(i, force_N, other[2]) : other[axis];
        history.add(hold[axis]);
        result.position_m[at][axis] = history.largest_position_m();
        result.velocity_m_s[at][axis] = history.largest_velocity_m_s();
      }
    }
    return result;
  }

  /// Finds radii that prove themselves. Returns false if there are none within the prepared tube; `reached` then
  /// holds the radii that were too large.
  bool least(Radii& found, Radii& reached) const {
    Radii r = Radii::none(scene_.vehicles());
    double last_step = 0;
    for (int i = 0; i < kMostSteps; ++i) {
      const Radii next = allowed(r);
      reached = next;
      if (!next.within(largest_)) return false;
      const double step = distance(next, r);
      const double ratio = last_step > 0 ? std::min(step / last_step, 0.999) : 0;
      // Assumes a geometric series from here on, with some margin.
      Radii guess = extrapolated(r, next, 1.05 * ratio / (1 - ratio)).scaled(1 + kRelative, kAbsolute);
      if (guess.within(largest_) && proves_itself(guess)) {
        tighten(guess);
        found = guess;
        return true;
      }
      if (i > 2 && !(step > 0)) break;
      last_step = step;
      r = next;
    }
    // The fixed point itself may lie on the boundary of the tube.
    if (!proves_itself(largest_)) return false;
    found = largest_;
    tighten(found);
    return true;
  }

  const std::vector<TruthSizes>& truth() const { return truth_; }

 private:
  bool proves_itself(const Radii& r) const { return allowed(r).below(r); }

  void tighten(Radii& r) const {
    for (int i = 0; i < 20; ++i) {
      const Radii smaller = allowed(r).scaled(1 + kRelative, kAbsolute);
      if (!smaller.within(r) || !proves_itself(smaller)) return;
      const bool is_same = distance(r, smaller) < kRelative * size(r);
      r = smaller;
      if (is_same) return;
    }
  }

  template <class Term>
  static double largest(const Radii& a, const Radii& b, const Term& term) {
    double most = 0;
    for (std::size_t i = 0; i < a.position_m.size(); ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        most = std::max({most, term(a.position_m[i][k], b.position_m[i][k]),
                         term(a.velocity_m_s[i][k], b.velocity_m_s[i][k])});
      }
    }
    return most;
  }
  static double distance(const Radii& a, const Radii& b) {
    return largest(a, b, [](double x, double y) { return std::abs(x - y); });
  }
  static double size(const Radii& a) {
    return largest(a, a, [](double x, double) { return x; });
  }
  static Radii extrapolated(const Radii& from, const Radii& to, double factor) {
    Radii result = to;
    for (std::size_t i = 0; i < to.position_m.size(); ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        result.position_m[i][k] += factor * (to.position_m[i][k] - from.position_m[i][k]);
        result.velocity_m_s[i][k] += factor * (to.velocity_m_s[i][k] - from.velocity_m_s[i][k]);
      }
    }
    return result;
  }

  const Scene& scene_;
  const ForceBound& bound_;
  Radii largest_;
  std::vector<TruthSizes> truth_;
  std::vector<std::array<ErrorHistory, 3>> others_;
};

}  // namespace

double LeastTube::radius_m() const { return radii.largest_position_m(); }

LeastTube least_tube(const Scene& scene, ForceBound& bound, double farthest_m, double wanted_m) {
  LeastTube result;
  const Radii none = Radii::none(scene.vehicles());
  const auto prepared = [&](const Radii& largest) {
    std::vector<TruthSizes> truth = scene.truth_sizes(largest);
    if (bound.prepare(largest, truth)) return truth;
    result.cancelled = true;
    result.why = "interrupted";
    return std::vector<TruthSizes>();
  };
  std::vector<TruthSizes> truth = prepared(none);
  if (result.cancelled) return result;
  // B(0), below every tube.
  const Radii start = Trial(scene, bound, none, std::move(truth)).allowed(none);
  Radii largest = start.scaled(1.4, 1e-4);
  if (largest.largest_position_m() > wanted_m) {
    result.why = fmt::format(
        "the force error at the set points alone moves vehicles by {:.3g} m; tubes wider than {:.3g} m were "
        "not "
        "tried",
        start.largest_position_m(), wanted_m);
    return result;
  }
  for (int i = 0; i < kMostTrials; ++i) {
    truth = prepared(largest);
    // Earlier proofs remain valid when a later round is interrupted.
    if (result.cancelled) break;
    const Trial trial(scene, bound, largest, std::move(truth));
    Radii found, reached;
    if (trial.least(found, reached)) {
      const double before_m = result.proved ? result.radius_m(2) : largest.largest_position_m(2);
      result.proved = true;
      result.radii = found;
      result.force_N = bound.sizes(found);
      result.truth = trial.truth();
      const double radius_m = found.largest_position_m(2);
      result.loop_gain = radius_m > 0 ? std::max(0.0, 1 - start.largest_position_m(2) / radius_m) : 0;
      if (!(radius_m < before_m * (1 - kWorthwhile))) break;
      largest = found;
      continue;
    }
    if (result.proved) break;
    const Radii at_edge = trial.allowed(largest);
    const double radius_m = largest.largest_position_m(2);
    result.loop_gain =
        (at_edge.largest_position_m(2) - start.largest_position_m(2)) / std::max(radius_m, 1e-12);
    result.why = fmt::format(
        "a radius of {:.3g} m lets |f_hat - f_a| grow so far that the loop responds with {:.3g} m: an error "
        "of one metre adds {:.3g} m to its own bound",
        radius_m, at_edge.largest_position_m(2), result.loop_gain);
    const Radii wider = larger(largest, reached).scaled(1.25, 0);
    if (!(wider.largest_position_m() <= std::min(farthest_m, wanted_m))) break;
    largest = wider;
  }
  if (result.proved) result.why.clear();
  return result;
}

}  // namespace swarmcert::analysis
