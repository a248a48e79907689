/// No slope exceeds its bound: random and adversarial pairs of points on all available networks, against the proved
/// bounds of each function, block and law. The closest ratio is printed to show how hard the test tried.
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
using lipschitz::CertifiedBound;
using tests::distance;
using tests::kLeastDistance;
using tests::kRounding;

/// A set function, or a single network, ready to be evaluated at many points.
class Function {
 public:
  Function(const Network& network, const files::FunctionId& function) {
    const auto parts = files::parts(network);
    const std::vector<files::FunctionId> names = function.parts();
    moved_.emplace(*parts.at(names[0]));
    inputs_ = parts.at(names[0])->inputs();
    if (names.size() == 2) rho_.emplace(*parts.at(names[1]));
  }
  int inputs() const { return inputs_; }
  bool is_set() const { return rho_.has_value(); }
  std::vector<double> hidden(const std::vector<double>& x) const { return (*moved_)(x); }
  std::vector<double> output(const std::vector<double>& sum) const { return rho_ ? (*rho_)(sum) : sum; }

 private:
  std::optional<Evaluator<double>> moved_, rho_;
  int inputs_ = 0;
};

struct Tally {
  long tried = 0;
  double closest = 0;  ///< largest ratio of slope to bound
};

/// Tries pairs for one bound: around random points, and around the steepest pair found by the search, with the other
/// neighbours where it placed them. In the random case the `sum` of the others is drawn again.
void try_pairs(const Network& network, const CertifiedBound& bound, const std::vector<int>& block, long pairs,
               std::uint64_t seed, Tally& tally) {
  const Function f(network, bound.function);
  Random random(seed);
  std::vector<double> others, others_of_witness;
  const bool has_witness = bound.lower.witness && !bound.lower.witness->x.empty();
  if (f.is_set()) {
    others_of_witness.assign(f.hidden(std::vector<double>(static_cast<std::size_t>(f.inputs()), 0.0)).size(),
                             0.0);
    for (std::size_t j = 0; has_witness && j < bound.lower.witness->others.size(); ++j) {
      const auto& point = bound.lower.witness->others[j];
      const Evaluator<double> other(*files::parts(network).at(bound.lower.other_networks[j]));
      const std::vector<double> value = other(std::vector<double>(point.begin(), point.end()));
      for (std::size_t i = 0; i < value.size(); ++i) others_of_witness[i] += value[i];
    }
  }
  for (long pair = 0; pair < pairs; ++pair) {
    const bool adversarial = has_witness && pair % 2 == 0;
    const double spread = std::exp2(random.uniform() * 16 - 14);
    std::vector<double> x, y;
    for (int k = 0; k < f.inputs(); ++k) {
      const auto i = static_cast<std::size_t>(k);
      if (adversarial) {
        x.push_back(static_cast<double>(bound.lower.witness->x[i]) + spread * random.symmetric());
        y.push_back(static_cast<double>(bound.lower.witness->y[i]) + spread * random.symmetric());
      } else {
        x.push_back(4 * random.symmetric());
        y.push_back(x.back() + spread * 16 * random.symmetric());
      }
    }
    for (std::size_t k = 0; k < x.size(); ++k)
      if (std::find(block.begin(), block.end(), static_cast<int>(k)) == block.end()) y[k] = x[k];
    const double moved = distance(x, y);
    if (moved < kLeastDistance) continue;
    std::vector<double> a = f.hidden(x), b = f.hidden(y);
    if (f.is_set()) {
      if (!adversarial) {
        others.resize(a.size());
        for (double& value : others) value = 20 * random.symmetric();
      }
      const std::vector<double>& sum = adversarial ? others_of_witness : others;
      for (std::size_t i = 0; i < a.size(); ++i) a[i] += sum[i], b[i] += sum[i];
    }
    const double ratio = distance(f.output(a), f.output(b)) / moved / bound.upper.value();
    ASSERT_LE(ratio, 1 + kRounding) << bound.function << " " << bound.block << ", pair " << pair;
    tally.closest = std::max(tally.closest, ratio);
    ++tally.tried;
  }
}

/// Returns the bundled network, random ones of several shapes, and the published ones if available.
std::vector<Network> networks() {
  std::vector<Network> result;
  files::NetworkArguments arguments;
  arguments.file = tests::source_path("nn/networks/demo/network.toml");
  result.push_back(files::load_network(arguments));
  std::mt19937 generator(1);
  for (const int width : {3, 8})
    result.push_back(tests::deep_set(tests::random_network({6, width, width, 5}, generator),
                                     tests::random_network({5, width, 1}, generator)));
  if (!tests::data_is_present()) return result;
  const auto weights = [](const std::string& name) {
    return files::load_weights(tests::data_path("weights/" + name));
  };
  Network published;
  published.phi["ground"] = weights("zip_f32/phi_G.pth");
  published.phi["large"] = weights("zip_f32/phi_L.pth");
  published.phi["small"] = weights("zip_f32/phi_S.pth");
  published.rho["large"] = weights("zip_f32/rho_L.pth");
  published.rho["small"] = weights("zip_f32/rho_S.pth");
  result.push_back(published);
  Network earlier;
  earlier.phi["large"] = weights("legacy_f64/phi_L.pth");
  earlier.rho["large"] = weights("legacy_f64/rho_L.pth");
  result.push_back(earlier);
  return result;
}

void no_slope_exceeds_its_bound(long pairs, int rounds, const std::vector<std::string>& blocks) {
  Tally total;
  std::uint64_t seed = 1;
  std::vector<Network> all = networks();
  lipschitz::CertifyOptions options;
  options.lower.rounds = rounds;
  options.blocks = blocks;
  std::vector<lipschitz::Certification> found;
  std::size_t bounds = 0;
  for (const Network& network : all) {
    found.push_back(lipschitz::certify(network, options));
    bounds += found.back().bounds.size();
  }
  const long each = (pairs * 11 / 10) / static_cast<long>(bounds) + 1;  // some pairs are too close to count
  for (std::size_t n = 0; n < all.size(); ++n) {
    for (const CertifiedBound& bound : found[n].bounds) {
      Tally tally;
      try_pairs(all[n], bound, files::block_coordinates(all[n], bound.function, bound.block), each, seed++,
                tally);
      if (testing::Test::HasFatalFailure()) return;
      total.tried += tally.tried;
      total.closest = std::max(total.closest, tally.closest);
      EXPECT_GT(tally.closest, 0) << bound.function;
    }
  }
  std::printf("%ld slopes, none above its bound; the closest is %.4f of it\n", total.tried, total.closest);
  EXPECT_GE(total.tried, pairs * 9 / 10);
  EXPECT_GT(total.closest, 0.9) << "no pair came near its bound: the test does not try hard enough";
}

TEST(SlopeSoundness, NoSlopeExceedsItsBound) { no_slope_exceeds_its_bound(50'000, 1, {}); }
TEST(SlopeSoundness, NoneOfTenMillionSlopesExceedsItsBound_slow) {
  no_slope_exceeds_its_bound(10'000'000, 10, {"position", "velocity"});
}

/// Moves several neighbours at once, and the vehicle itself, and compares with the laws.
TEST(SlopeSoundness, NoMoveOfSeveralNeighboursExceedsItsLaw) {
  std::mt19937 generator(2);
  Network network;
  network.phi["large"] = tests::random_network({6, 8, 5}, generator);
  network.phi["small"] = tests::random_network({6, 7, 5}, generator);
  network.rho["small"] = tests::random_network({5, 8, 1}, generator);
  lipschitz::CertifyOptions options;
  options.lower.rounds = 0;
  options.mixture = {{"large", 1}, {"small", 2}};
  const lipschitz::Certification found = lipschitz::certify(network, options);
  const Evaluator<double> large(network.phi.at("large")), small(network.phi.at("small")),
      rho(network.rho.at("small"));
  Random random(3);
  double closest = 0;
  for (int sample = 0; sample < 100'000; ++sample) {
    const double spread = std::exp2(random.uniform() * 12 - 10);
    const bool together = sample % 2 == 0;  // own state: all inputs move equally
    std::vector<double> common(6);
    for (double& value : common) value = spread * random.symmetric();
    std::vector<double> before(5, 0.0), after(5, 0.0);
    double squares = 0;
    double largest = 0;
    for (int j = 0; j < 3; ++j) {
      std::vector<double> x(6), y(6);
      for (std::size_t k = 0; k < 6; ++k) {
        x[k] = 3 * random.symmetric();
        y[k] = x[k] + (together ? common[k] : spread * random.symmetric());
      }
      const std::vector<double> a = (j == 0 ? large : small)(x), b = (j == 0 ? large : small)(y);
      for (std::size_t i = 0; i < 5; ++i) before[i] += a[i], after[i] += b[i];
      squares += distance(x, y) * distance(x, y);
      largest = std::max(largest, distance(x, y));
    }
    const double change = distance(rho(before), rho(after));
    for (const lipschitz::CertifiedLaw& law : found.laws) {
      const bool stacked = law.law == lipschitz::LawKind::kAllStacked;
      if (law.law == lipschitz::LawKind::kOwnState && !together) continue;
      const double ratio = change / (stacked ? std::sqrt(squares) : largest) / law.upper.value();
      ASSERT_LE(ratio, 1 + kRounding) << name(law.law);
      closest = std::max(closest, ratio);
    }
  }
  std::printf("closest to a law: %.4f\n", closest);
  EXPECT_GT(closest, 0.1);
}

}  // namespace
}  // namespace swarmcert
