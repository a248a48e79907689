/// No slope inside the box exceeds its bound from branch and bound: random and adversarial pairs of points, for any
/// number of neighbours and for a given number, with the other neighbours inside the box as well.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>

#include "data.h"
#include "lipschitz/certify.h"
#include "lipschitz/networks.h"
#include "nn/base/random.h"
#include "nn/weights/functions.h"
#include "soundness/distance.h"

namespace swarmcert {
namespace {

using files::Evaluator;
using files::Network;
using files::Random;
using lipschitz::Box;
using lipschitz::CertifiedBound;
using tests::distance;
using tests::kLeastDistance;
using tests::kRounding;
using Point = std::vector<double>;

Point inside(const Box& box, Random& random) {
  Point x;
  for (std::size_t k = 0; k < box.lower.size(); ++k)
    x.push_back(box.lower[k] + random.uniform() * (box.upper[k] - box.lower[k]));
  return x;
}

void add(Point& sum, const Point& term) {
  for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += term[i];
}

/// Evaluates one bound's function at pairs of points.
class PairsInTheBox {
 public:
  PairsInTheBox(const Network& network, const lipschitz::Domain& domain, const CertifiedBound& bound)
      : domain_(domain), bound_(bound), names_(bound.function.parts()) {
    for (const auto& [name, weights] : files::parts(network)) parts_.emplace(name, *weights);
    block_ = files::block_coordinates(network, bound.function, bound.block);
  }

  /// Returns the largest ratio of slope to bound over at most `pairs` pairs, and counts them in `tried`.
  double largest_ratio(long pairs, Random& random, long& tried) const {
    double largest = 0;
    for (long pair = 0; pair < pairs; ++pair) {
      const bool adversarial = pair % 2 == 0 && bound_.lower.witness;
      const auto [x, y] = points(adversarial, random);
      if (distance(x, y) < kLeastDistance) continue;
      Point a = parts_.at(names_[0])(x), b = parts_.at(names_[0])(y);
      if (names_.size() == 2) {
        const Point others = sum_of_others(adversarial, a.size(), random);
        add(a, others);
        add(b, others);
        a = parts_.at(names_[1])(a);
        b = parts_.at(names_[1])(b);
      }
      largest = std::max(largest, distance(a, b) / distance(x, y) / bound_.upper.value());
      ++tried;
    }
    return largest;
  }

 private:
  std::pair<Point, Point> points(bool adversarial, Random& random) const {
    const Box& box = domain_.at(names_[0]);
    const double spread = std::exp2(random.uniform() * 14 - 14);
    Point x = inside(box, random), y = inside(box, random);
    for (std::size_t k = 0; k < x.size(); ++k) {
      if (adversarial) {  // near the steepest pair found by the search
        x[k] = bound_.lower.witness->x[k] + spread * (x[k] - bound_.lower.witness->x[k]);
        y[k] = bound_.lower.witness->y[k] + spread * (y[k] - bound_.lower.witness->y[k]);
      } else {
        y[k] = x[k] + spread * (y[k] - x[k]);
      }
      if (std::find(block_.begin(), block_.end(), static_cast<int>(k)) == block_.end()) y[k] = x[k];
    }
    return {x, y};
  }

  Point sum_of_others(bool adversarial, std::size_t size, Random& random) const {
    Point sum(size, 0.0);
    if (adversarial) {
      for (std::size_t j = 0; j < bound_.lower.witness->others.size(); ++j) {
        const auto& at = bound_.lower.witness->others[j];
        add(sum, parts_.at(bound_.lower.other_networks[j])(Point(at.begin(), at.end())));
      }
      return sum;
    }
    if (bound_.neighbours.empty()) {
      for (double& value : sum) value = 20 * random.symmetric();
      return sum;
    }
    const auto add_one = [&](const files::FunctionId& part) {
      add(sum, parts_.at(part)(inside(domain_.at(part), random)));
    };
    if (!names_[0].is_ground_phi() && parts_.count(files::FunctionId::ground_phi()) == 1)
      add_one(files::FunctionId::ground_phi());
    for (const auto& [kind, count] : bound_.neighbours) {
      const int others = count - (files::FunctionId::phi(kind) == names_[0] ? 1 : 0);
      for (int j = 0; j < others; ++j)
        if (random.uniform() < 0.7) add_one("phi:" + kind);
    }
    return sum;
  }

  const lipschitz::Domain& domain_;
  const CertifiedBound& bound_;
  std::vector<files::FunctionId> names_;
  std::map<files::FunctionId, Evaluator<double>> parts_;
  std::vector<int> block_;
};

std::vector<Network> examples() {
  std::vector<Network> result;
  std::mt19937 generator(11);
  Network made;
  made.phi["ground"] = tests::random_network({4, 6, 5}, generator);
  made.phi["large"] = tests::random_network({6, 7, 5}, generator);
  made.phi["small"] = tests::random_network({6, 8, 6, 5}, generator);
  made.rho["small"] = tests::random_network({5, 8, 1}, generator);
  result.push_back(made);
  Network alone;
  alone.plain = tests::random_network({3, 9, 9, 2}, generator);
  result.push_back(alone);
  if (!tests::data_is_present()) return result;
  const auto weights = [](const std::string& name) {
    return files::load_weights(tests::data_path("weights/zip_f32/" + name + ".pth"));
  };
  Network published;
  published.phi["large"] = weights("phi_L");
  published.rho["large"] = weights("rho_L");
  result.push_back(published);
  Network ground;
  ground.plain = weights("phi_G");
  result.push_back(ground);
  return result;
}

lipschitz::Domain boxes_of(const Network& network) {
  lipschitz::Domain domain;
  for (const auto& [name, weights] : files::parts(network)) {
    if (name.is_rho()) continue;
    const int inputs = weights->inputs(), positions = inputs == 4 ? 1 : 3;
    Box box;
    for (int k = 0; k < inputs; ++k) {
      box.upper.push_back(k < positions ? 1 : 2);
      box.lower.push_back(-box.upper.back());
    }
    domain[name] = box;
  }
  return domain;
}

void no_slope_in_the_box_exceeds_its_bound(long pairs, int nodes) {
  const std::vector<Network> networks = examples();
  std::vector<lipschitz::Certification> found;
  std::size_t bounds = 0;
  for (const Network& network : networks) {
    lipschitz::CertifyOptions options;
    options.method = lipschitz::UpperMethod::kBranch;
    options.domain = boxes_of(network);
    options.branch.nodes = nodes;
    options.lower.rounds = 2;
    if (!network.rho.empty()) options.neighbours = 2;
    found.push_back(lipschitz::certify(network, options));
    bounds += found.back().bounds.size();
  }
  Random random(5);
  long tried = 0;
  int local = 0, counted = 0;
  double closest = 0;
  for (std::size_t n = 0; n < networks.size(); ++n) {
    for (const CertifiedBound& bound : found[n].bounds) {
      if (bound.function.is_rho()) continue;
      local += bound.method == lipschitz::UpperMethod::kBranch ? 1 : 0;
      counted += bound.neighbours.empty() ? 0 : 1;
      const PairsInTheBox slopes(networks[n], found[n].domain, bound);
      const double ratio =
          slopes.largest_ratio(pairs * 12 / 10 / static_cast<long>(bounds) + 1, random, tried);
      EXPECT_LE(ratio, 1 + kRounding) << bound.function << (bound.neighbours.empty() ? "" : " counted");
      closest = std::max(closest, ratio);
    }
  }
  std::printf("%ld slopes under %d local bounds, %d of them for a stated number; the closest is %.4f\n",
              tried, local, counted, closest);
  EXPECT_GE(tried, pairs * 7 / 10);
  EXPECT_GE(local, 4);
  EXPECT_GE(counted, 2);
  EXPECT_GT(closest, 0.8) << "no pair came near its bound: the test does not try hard enough";
}

TEST(LocalSlopeSoundness, NoSlopeInTheBoxExceedsItsBound) {
  no_slope_in_the_box_exceeds_its_bound(40'000, 60);
}
TEST(LocalSlopeSoundness, NoneOfAMillionSlopesInTheBoxExceedsItsBound_slow) {
  no_slope_in_the_box_exceeds_its_bound(1'500'000, 3000);
}

}  // namespace
}  // namespace swarmcert
