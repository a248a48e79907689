#include "lipschitz/float32_search.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "lipschitz/base/rounding.h"
#include "lipschitz/checker/witness.h"
#include "nn/arithmetic.h"
#include "nn/base/random.h"
#include "nn/weights/compositions.h"
#include "nn/weights/functions.h"

namespace swarmcert::lipschitz {
namespace {

/// Numbers of evaluations of one local search: random points, then steps of the set of points, then of its worst point.
constexpr int kRandomErrors = 1000, kCloudSteps = 250, kCloudPoints = 16, kErrorSteps = 10000;
/// Binary logarithm of the size of the set of points relative to the box, so that its mean error varies smoothly.
constexpr double kCloud_log2 = -10;
/// Binary logarithm of the shortest steps, about the distance between neighbouring floats.
constexpr double kShortestErrorStep_log2 = -24;

using Points = std::vector<std::vector<float>>;

class ErrorSearch {
 public:
  ErrorSearch(const files::Network& network, const Domain& domain, const files::FunctionId& function,
              int neighbours, std::uint64_t seed)
      : network_(network),
        function_(function),
        parts_(files::parts(network)),
        names_(function.parts()),
        random_(seed) {
    const bool is_set = names_.size() == 2;
    if (is_set && parts_.count(files::FunctionId::ground_phi()) == 1)
      terms_.emplace_back(files::FunctionId::ground_phi());
    has_ground_ = !terms_.empty();
    for (int j = 0; j < (is_set ? neighbours : 1); ++j) terms_.push_back(names_[0]);
    for (const files::FunctionId& term : terms_) boxes_.push_back(&domain.at(term));
    for (const auto& [name, weights] : parts_) {
      if (std::find(names_.begin(), names_.end(), name) == names_.end() && !name.is_ground_phi()) continue;
      in_double_.emplace(name, files::Evaluator<double>(*weights));
      in_float_.emplace(name, files::Evaluator<float>(*weights));
    }
  }

  /// One local search from a random point; returns its worst point and an estimate of the error there; no points if the
  /// box contains no float32.
  std::pair<double, Points> climb() {
    Points best;
    double worst = -1;
    for (int i = 0; i < kRandomErrors; ++i) {
      Points x = random_points();
      if (x.empty()) return {-1, {}};
      take(std::move(x), worst, best);
    }
    Points centre = best;
    double size = cloud(centre, worst, best);
    for (int i = 0; i < kCloudSteps; ++i) {
      const Points x = moved(centre, std::exp2(-1 + (kCloud_log2 + 3) * i / kCloudSteps));
      if (const double there = cloud(x, worst, best); there > size) size = there, centre = x;
    }
    for (int i = 0; i < kErrorSteps; ++i)
      take(moved(best, std::exp2(-4 + (kShortestErrorStep_log2 + 4) * random_.uniform())), worst, best);
    return {worst, best};
  }

  /// Returns the exact error at a point, rounded down.
  Attained attained(Points points) const {
    Attained result;
    if (points.empty()) return result;
    const std::vector<float> flown = in_float32(points);
    const std::vector<mpq_class> exact = value(network_, function_, terms_, points);
    mpq_class square;
    for (std::size_t i = 0; i < flown.size(); ++i) {
      const mpq_class off = mpq_class(static_cast<double>(flown[i])) - exact[i];
      square += off * off;
    }
    result.value = sqrt_down(square);
    result.networks = terms_;
    result.points = std::move(points);
    return result;
  }

 private:
  void take(Points x, double& worst, Points& best) const {
    const double off = error(x);
    if (!(off > worst)) return;
    worst = off;
    best = std::move(x);
  }

  /// Returns an estimate of the root mean square error around x; keeps the worst point.
  double cloud(const Points& x, double& worst, Points& best) {
    double squares = 0;
    for (int i = 0; i < kCloudPoints; ++i) {
      Points near = moved(x, std::exp2(kCloud_log2));
      const double off = error(near);
      squares += off * off;
      if (off > worst) worst = off, best = std::move(near);
    }
    return std::sqrt(squares / kCloudPoints);
  }

  Points random_points() {
    Points points;
    for (const Box* const box : boxes_) {
      points.emplace_back();
      for (std::size_t k = 0; k < box->lower.size(); ++k) {
        const double share = std::clamp(1.5 * random_.uniform() - 0.25, 0.0, 1.0);
        const std::optional<float> there = nearest_float(
            box->lower[k] + share * (box->upper[k] - box->lower[k]), box->lower[k], box->upper[k]);
        if (!there) return {};
        points.back().push_back(*there);
      }
    }
    return points;
  }

  /// Returns x with some coordinates moved by up to `scale` times the sides of the box.
  Points moved(Points points, double scale) {
    const bool is_one = random_.below(3) == 0;  // coordinate
    const std::uint64_t which = random_.below(points.size());
    for (std::size_t j = 0; j < points.size(); ++j) {
      if (is_one && j != which) continue;
      const Box& box = *boxes_[j];
      const std::uint64_t only = random_.below(box.lower.size());
      for (std::size_t k = 0; k < box.lower.size(); ++k) {
        if (is_one ? k != only : random_.below(2) == 0) continue;
        float& x = points[j][k];  // one is in the box, so that there is a nearest
        const double to =
            static_cast<double>(x) + scale * (box.upper[k] - box.lower[k]) * random_.symmetric();
        x = nearest_float(to, box.lower[k], box.upper[k]).value_or(x);
      }
    }
    return points;
  }

  double error(const Points& points) const {
    const std::vector<float> flown = in_float32(points);
    const std::vector<double> exact = in_double(points);
    double square = 0;
    for (std::size_t i = 0; i < flown.size(); ++i) {
      const double off = static_cast<double>(flown[i]) - exact[i];
      square += off * off;
    }
    return std::sqrt(square);
  }

  std::vector<double> in_double(const Points& points) const {
    std::vector<double> sum;
    for (std::size_t j = 0; j < points.size(); ++j) {
      const std::vector<double> term = in_double_.at(terms_[j])({points[j].begin(), points[j].end()});
      if (sum.empty()) sum.resize(term.size());
      for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += term[i];
    }
    return names_.size() == 1 ? sum : in_double_.at(names_[1])(sum);
  }

  /// Evaluation as in nn/deep_set.h: first the ground, then the neighbours in the order of their bits.
  std::vector<float> in_float32(const Points& points) const {
    if (names_.size() == 1) return in_float_.at(names_[0])(points[0]);
    std::vector<const std::vector<float>*> order;
    for (std::size_t j = has_ground_ ? 1 : 0; j < points.size(); ++j) order.push_back(&points[j]);
    std::sort(order.begin(), order.end(), [](const std::vector<float>* a, const std::vector<float>* b) {
      return std::lexicographical_compare(a->begin(), a->end(), b->begin(), b->end(),
                                          [](float x, float y) { return nn::bits(x) < nn::bits(y); });
    });
    std::vector<float> sum(static_cast<std::size_t>(parts_.at(names_[1])->inputs()));
    if (has_ground_) sum = in_float_.at(terms_[0])(points[0]);
    for (const std::vector<float>* const x : order) {
      const std::vector<float> term = in_float_.at(names_[0])(*x);
      for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += term[i];
    }
    return in_float_.at(names_[1])(sum);
  }

  const files::Network& network_;
  files::FunctionId function_;
  files::Parts parts_;
  std::vector<files::FunctionId> names_, terms_;
  std::vector<const Box*> boxes_;
  bool has_ground_ = false;
  files::Random random_;
  std::map<files::FunctionId, files::Evaluator<double>> in_double_;
  std::map<files::FunctionId, files::Evaluator<float>> in_float_;
};

}  // namespace

Attained float32_error_found(const files::Network& network, const Domain& domain,
                             const files::FunctionId& function, int neighbours, const Float32Search& search) {
  ErrorSearch errors(network, domain, function, neighbours, search.seed);
  std::pair<double, Points> worst{-1, {}};
  for (int start = 0; start < search.starts; ++start) {
    std::pair<double, Points> found = errors.climb();
    if (found.first > worst.first) worst = std::move(found);
  }
  return errors.attained(std::move(worst.second));
}

}  // namespace swarmcert::lipschitz
