#include "lipschitz/lower/slope_estimate.h"

#include <algorithm>
#include <random>

#include "lipschitz/lower/sampled_function.h"
#include "lipschitz/values/range.h"
#include "nn/weights/functions.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::VectorXd;

/// Maximum number of multiplications of all starts together, or of a single start.
constexpr double kMostWork = 2e9;

/// Effort for one start.
struct Effort {
  int climbs, ascents;
};

/// Returns the effort per start: less for functions whose Jacobian alone takes a large share of kMostWork.
Effort affordable_effort(double work) {
  constexpr int kClimbs = 24, kAscents = 40;
  constexpr double kShareOfClimbs = 1.0 / 6, kShareOfAscents = 1.0 / 12;
  const auto part = [work](double share, int most) {
    return static_cast<int>(std::clamp(share * kMostWork / work, 1.0, 1.0 * most));
  };
  return {part(kShareOfClimbs, kClimbs), part(kShareOfAscents, kAscents)};
}

struct Place {
  VectorXd x;
  SampledFunction::Steepness steepness;
  double half_step;
};

Place at(const SampledFunction& f, VectorXd x) {
  SampledFunction::Steepness steepness = f.steepest(x);
  return {std::move(x), std::move(steepness), f.half_step()};
}

/// Runs the starts one after the other.
class SteepSearch {
 public:
  SteepSearch(SampledFunction f, const SlopeEstimateOptions& options)
      : f_(std::move(f)),
        effort_(affordable_effort(f_.work())),
        generator_(options.seed),
        stop_(options.stop) {}

  /// Returns the number of starts that kMostWork allows. A step of the ascent needs a Jacobian and a gradient, which
  /// costs as much as two Jacobians.
  double affordable_starts() const {
    return kMostWork / (f_.work() * (effort_.climbs + 6.0 * effort_.ascents));
  }

  const SampledFunction& function() const { return f_; }

  /// Returns the steepest place reached from the next start. The first start is the centre, because many activations
  /// are steepest at 0. The search ends with a smaller distance of the points, in case the slope varies within the
  /// original distance.
  Place next(bool is_first) {
    constexpr double kCloser = 0x1p-6, kMoreThanNoise = 1 + 1e-6, kNear = 0.5;
    constexpr int kClimbsWhereFlat = 8;
    f_.place_others(generator_);
    const VectorXd random = f_.random_point(generator_);
    Place place = at(f_, is_first ? f_.middle() : random);
    climb(1, place);
    if (!ascend(place))
      for (int i = 0; i < kClimbsWhereFlat; ++i) climb(kNear, place);
    const double half_step = f_.half_step();
    f_.set_half_step(kCloser * half_step);
    Place closer = at(f_, place.x);
    ascend(closer);
    f_.set_half_step(half_step);
    return closer.steepness.slope > kMoreThanNoise * place.steepness.slope ? closer : place;
  }

 private:
  /// Moves towards random points by decreasing shares of the distance, as long as the slope increases.
  void climb(double share, Place& place) {
    for (int i = 0; i < effort_.climbs && !stop_.now(); ++i) {
      Place next = at(f_, place.x + share * (f_.random_point(generator_) - place.x));
      if (next.steepness.slope > place.steepness.slope) {
        place = std::move(next);
      } else {
        share *= 0.8;
      }
    }
  }

  /// Moves along the gradient with steps that grow while they increase the slope. Returns false if the gradient is
  /// zero, as it is inside a linear region.
  bool ascend(Place& place) const {
    constexpr double kFirst = 0.05, kLeast = 1e-7, kGrow = 2, kShrink = 0.25, kNoise = 1e-8;
    double length = kFirst;
    VectorXd uphill;
    for (int i = 0; i < effort_.ascents && length > kLeast && !stop_.now(); ++i) {
      if (uphill.size() == 0) uphill = f_.gradient(place.x, place.steepness.direction);
      if (!(uphill.norm() > kNoise * place.steepness.slope)) return false;
      Place next = at(f_, f_.moved(place.x, length * uphill.normalized()));
      if (next.steepness.slope > place.steepness.slope) {
        place = std::move(next);
        length *= kGrow;
        uphill.resize(0);
      } else {
        length *= kShrink;
      }
    }
    return true;
  }

  SampledFunction f_;
  Effort effort_;
  std::mt19937_64 generator_;
  Stop stop_;
};

}  // namespace

SteepPlace steep_place(const files::Network& network, const Claim& claim,
                       const SlopeEstimateOptions& options) {
  SteepSearch search(SampledFunction(network, claim, clamped(network, options.domain)), options);
  const double most = std::max(options.starts, 1);
  const int starts = static_cast<int>(std::clamp(search.affordable_starts(), 1.0, most));
  SteepPlace best;
  for (int start = 0; start < starts; ++start) {
    Place place = search.next(start == 0);
    best.interrupted = options.stop.now();
    if (best.interrupted && start > 0) break;
    best.starts = start + 1;
    if (start > 0 && !(place.steepness.slope > best.slope.value())) continue;
    best.slope = Estimate(place.steepness.slope);
    best.direction = search.function().in_inputs(place.steepness.direction);
    best.x = std::move(place.x);
    best.half_step = place.half_step;
    best.other_networks = search.function().other_networks();
    best.others = search.function().others();
    if (best.interrupted) break;
  }
  return best;
}

Estimate slope_estimate(const files::Network& network, const Claim& claim,
                        const SlopeEstimateOptions& options) {
  return steep_place(network, claim, options).slope;
}

}  // namespace swarmcert::lipschitz
