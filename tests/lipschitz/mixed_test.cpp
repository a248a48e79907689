/// Bounds and certificates of networks with several activations.
#include <Eigen/SVD>
#include <cmath>
#include <functional>

#include "lipschitz/certify.h"
#include "lipschitz/checker/check.h"
#include "lipschitz/lower/slope_estimate.h"
#include "lipschitz/networks.h"
#include "nn/base/content_hash.h"
#include "nn/weights/activation.h"

namespace swarmcert {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using files::Activation;
using files::Json;
using files::Network;
using files::Weights;
using lipschitz::CertifiedBound;
using lipschitz::CertifyOptions;
using lipschitz::UpperMethod;
using Mixture = std::vector<Activation>;

Weights mixed(const std::vector<int>& sizes, const Mixture& between, unsigned seed) {
  std::mt19937 generator(seed);
  Weights weights = tests::random_network(sizes, generator);
  weights.set_activations(between);
  return weights;
}

lipschitz::Certification certify_mixed(const Network& network, UpperMethod method = UpperMethod::kAuto) {
  CertifyOptions options;
  options.method = method;
  options.lower.rounds = 1;
  options.jobs = 1;
  return certify(network, options);
}

CertifiedBound mixed_bound(const Network& network, UpperMethod method = UpperMethod::kAuto,
                           const files::FunctionId& function = "network") {
  for (const CertifiedBound& bound : certify_mixed(network, method).bounds)
    if (bound.function == function && bound.block == "all") return bound;
  ADD_FAILURE() << "no bound of " << function;
  return {};
}

/// Maximises the norm of W_K D_(K-1) ... D_1 W_1 over slopes by an ascent; each slope is at an end of its interval.
class AdversarialSlopes {
 public:
  AdversarialSlopes(const Weights& weights, std::mt19937& generator) {
    for (const files::Layer& layer : weights.layers) {
      using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
      w_.emplace_back(Eigen::Map<const RowMajor>(layer.weights.data(), layer.outputs, layer.inputs));
    }
    for (std::size_t k = 0; k + 1 < weights.layers.size(); ++k) {
      const files::ActivationFunction& function = files::function_of(weights.layers[k].activation);
      ends_.push_back({function.least_slope, function.greatest_slope});
      VectorXd slopes(w_[ends_.size() - 1].rows());
      for (Index i = 0; i < slopes.size(); ++i) slopes[i] = ends_.back()[generator() % 2];
      kept_.push_back(weights.layers[k].kept);
      slopes.tail(kept_.back()).setOnes();
      slopes_.push_back(slopes);
    }
  }

  double climb() {
    double best = norm();
    for (bool improves = true; improves;) {
      improves = false;
      for (std::size_t k = 0; k < slopes_.size(); ++k)
        for (Index i = 0; i < slopes_[k].size() - kept_[k]; ++i) {
          const double before = slopes_[k][i];
          slopes_[k][i] = before == ends_[k][0] ? ends_[k][1] : ends_[k][0];
          const double there = norm();
          improves = improves || there > best * (1 + 1e-12);
          if (there > best * (1 + 1e-12)) {
            best = there;
          } else {
            slopes_[k][i] = before;
          }
        }
    }
    return best;
  }

 private:
  double norm() const {
    MatrixXd product = w_.front();
    for (std::size_t k = 0; k < slopes_.size(); ++k)
      product = w_[k + 1] * (slopes_[k].asDiagonal() * product);
    return product.jacobiSvd().singularValues()[0];
  }

  std::vector<MatrixXd> w_;
  std::vector<std::array<double, 2>> ends_;
  std::vector<Index> kept_;  ///< number of entries at the end of a layer that have slope 1
  std::vector<VectorXd> slopes_;
};

const std::vector<std::pair<std::vector<int>, Mixture>>& mixtures() {
  using A = Activation;
  static const std::vector<std::pair<std::vector<int>, Mixture>> all = {
      {{3, 10, 8, 2}, {A::kTanh, A::kRelu}},
      {{3, 10, 8, 2}, {A::kRelu, A::kSigmoid}},
      {{2, 8, 6, 6, 3}, {A::kRelu, A::kSilu, A::kTanh}},
      {{4, 6, 6, 6, 1}, {A::kGelu, A::kSelu, A::kSigmoid}},
      {{4, 7, 5, 2}, {A::kSoftplus, A::kElu}},
      {{1, 6, 6, 6, 2}, {A::kSilu, A::kGelu, A::kRelu}},
  };
  return all;
}

std::string mixed_words(const Weights& weights) { return weights.activation_names(); }

TEST(MixedBounds, AreAboveSampledAndAdversarialSlopesAndBelowTheProduct) {
  std::mt19937 generator(51);
  double closest = 0;
  unsigned seed = 52;
  for (const auto& [sizes, between] : mixtures()) {
    for (const bool ends : {false, true}) {
      Weights weights = mixed(sizes, between, seed++);
      if (ends) weights.end_in(Activation::kTanh);
      const CertifiedBound bound = mixed_bound(tests::plain(weights));
      const double upper = bound.upper.value();
      EXPECT_EQ(bound.method, UpperMethod::kSdp) << mixed_words(weights);
      EXPECT_LT(upper, bound.product.value()) << mixed_words(weights);
      const double sampled = tests::sampled_slope(weights, generator, 20000);
      EXPECT_LE(sampled, upper * (1 + 1e-9)) << mixed_words(weights);
      double adversarial = 0;
      for (int start = 0; start < 3; ++start)
        adversarial = std::max(adversarial, AdversarialSlopes(weights, generator).climb());
      EXPECT_LE(adversarial, upper * (1 + 1e-9)) << mixed_words(weights);
      closest = std::max(closest, adversarial / upper);
      const double estimate = lipschitz::slope_estimate(tests::plain(weights), bound, {}).value();
      EXPECT_LE(estimate, upper * (1 + 1e-9)) << mixed_words(weights);
      EXPECT_GE(estimate, 0.8 * sampled) << mixed_words(weights);
    }
  }
  EXPECT_GT(closest, 0.9) << "the adversary is too weak for a meaningful test";
}

TEST(MixedBounds, OfOneNeuronPerLayerAreTheProductOfWeightsAndSteepestSlopes) {
  Weights weights = tests::weights({tests::layer(1, 1, {3}), tests::layer(1, 1, {-2}),
                                    tests::layer(1, 1, {0.5}), tests::layer(1, 1, {5})});
  weights.set_activations({Activation::kSigmoid, Activation::kSilu, Activation::kTanh});
  const double silu = files::function_of(Activation::kSilu).steepest();
  EXPECT_NEAR(mixed_bound(tests::plain(weights)).upper.value(), 15 * silu / 4, 1e-6);
  EXPECT_NEAR(mixed_bound(tests::plain(weights), UpperMethod::kProduct).upper.value(), 15 * silu / 4, 1e-12);
}

TEST(MixedBounds, AnActivationAtTheEndMultipliesTheBoundByItsSteepestSlope) {
  for (const UpperMethod method : {UpperMethod::kSdp, UpperMethod::kProduct}) {
    const Weights weights = mixed({4, 12, 8, 3}, {Activation::kRelu, Activation::kRelu}, 53);
    const double without = mixed_bound(tests::plain(weights), method).upper.value();
    for (const Activation end :
         {Activation::kTanh, Activation::kSigmoid, Activation::kSelu, Activation::kRelu}) {
      Weights ended = weights;
      ended.end_in(end);
      const double slope = files::function_of(end).steepest();
      EXPECT_NEAR(mixed_bound(tests::plain(ended), method).upper.value(), slope * without, 1e-6 * without)
          << files::function_of(end).op;
    }
  }
}

TEST(MixedBounds, GammaIsOfTheLayersOfTheFileOnly) {
  Weights weights = tests::weights({tests::layer(1, 1, {0.5}), tests::layer(1, 1, {0.5})});
  weights.end_in(Activation::kTanh);
  Network network = tests::plain(weights);
  network.gamma = files::GammaStatement{0.5};
  const lipschitz::Certification per_layer = certify_mixed(network);
  ASSERT_EQ(per_layer.layers.size(), 3u);
  EXPECT_EQ(per_layer.layers[0].respects_gamma, lipschitz::Verdict::kProved);
  EXPECT_EQ(per_layer.layers[1].respects_gamma, lipschitz::Verdict::kProved);
  EXPECT_FALSE(per_layer.layers[2].respects_gamma.has_value());
  network.gamma = files::GammaStatement{0.25, files::GammaStatement::Scope::kNetwork,
                                        files::GammaStatement::Mode::kEqual};
  EXPECT_EQ(certify_mixed(network).layers[1].respects_gamma, lipschitz::Verdict::kProved);
}

TEST(MixedBounds, BesideALayerThatSortsAreBelowTheProductAndStayOutOfBoxes) {
  std::mt19937 generator(54);
  for (const Mixture& between :
       {Mixture{Activation::kMaxMinPairs, Activation::kRelu}, {Activation::kSigmoid, files::group_sort(4)}}) {
    const Weights weights = mixed({3, 8, 8, 2}, between, 55);
    const CertifiedBound bound = mixed_bound(tests::plain(weights));
    EXPECT_EQ(bound.method, UpperMethod::kSdp);
    EXPECT_LT(bound.upper.value(), bound.product.value());
    EXPECT_LE(tests::sampled_slope(weights, generator, 5000), bound.upper.value());
    const check::Intervals box = {{-1, -1, -1}, {1, 1, 1}};
    EXPECT_THROW(check::chain_on_box(tests::plain(weights), "network", "all", {}, box), std::domain_error);
  }
}

/// Returns a network that leaves the last `kept` entries of each layer unchanged, as with a skip connection.
Weights with_skip(const std::vector<int>& sizes, const std::vector<int>& kept, const Mixture& between,
                  unsigned seed) {
  Weights weights = mixed(sizes, between, seed);
  for (std::size_t k = 0; k < kept.size(); ++k) weights.layers[k].kept = kept[k];
  return weights;
}

TEST(MixedBounds, PastSkipConnectionsAreAboveSampledAndAdversarialSlopes) {
  std::mt19937 generator(61);
  unsigned seed = 62;
  for (const Mixture& between : {Mixture{Activation::kTanh, Activation::kSigmoid},
                                 {Activation::kSilu, Activation::kRelu},
                                 {Activation::kSelu, Activation::kGelu},
                                 {Activation::kElu, Activation::kSoftplus},
                                 {Activation::kSigmoid, Activation::kSigmoid}}) {
    const std::vector<int> kept = {3, between[1] == Activation::kRelu ? 0 : 2};
    const Weights weights = with_skip({3, 8, 7, 2}, kept, between, seed++);
    const Network network = tests::plain(weights);
    const CertifiedBound bound = mixed_bound(network);
    const double upper = bound.upper.value();
    SCOPED_TRACE(weights.activation_names());
    EXPECT_EQ(bound.method, UpperMethod::kSdp);
    EXPECT_LT(upper, bound.product.value());
    const double sampled = tests::sampled_slope(weights, generator, 200000);
    const double adversarial = AdversarialSlopes(weights, generator).climb();
    EXPECT_LE(sampled, upper * (1 + 1e-9));
    EXPECT_LE(adversarial, upper * (1 + 1e-9));
    EXPECT_GT(adversarial, 0.5 * upper) << "the bound is far above all slopes: the test shows little";
    ASSERT_TRUE(bound.lower.witness.has_value());
    EXPECT_LE(bound.lower.witness->slope.value(), upper);
    EXPECT_GE(bound.lower.witness->slope.value(), 0.8 * sampled);
  }
}

TEST(MixedBounds, OfOneNumberAndItsSkipConnectionAreExact) {
  // sigmoid(2 x) + 3 x has slopes 3 to 3.5; tanh(x) - x has slopes of absolute value 0 to 1.
  Weights sum = tests::weights({tests::layer(2, 1, {2, 1}), tests::layer(1, 2, {1, 3})});
  sum.layers[0].activation = Activation::kSigmoid;
  sum.layers[0].kept = 1;
  EXPECT_NEAR(mixed_bound(tests::plain(sum)).upper.value(), 3.5, 1e-6);
  Weights difference = tests::weights({tests::layer(2, 1, {1, 1}), tests::layer(1, 2, {1, -1})});
  difference.layers[0].activation = Activation::kTanh;
  difference.layers[0].kept = 1;
  EXPECT_NEAR(mixed_bound(tests::plain(difference)).upper.value(), 1, 1e-6);
}

TEST(MixedBounds, TheStageBehindEachActivationIsMultipliedByItsOwnSlope) {
  const Mixture between = {Activation::kSigmoid, Activation::kGelu, Activation::kSelu};
  const Weights weights = mixed({3, 4, 5, 6, 2}, between, 56);
  const check::BentChain chain = check::bent_chain(tests::plain(weights), "network");
  ASSERT_EQ(chain.stages.size(), 4u);
  ASSERT_EQ(chain.slopes.size(), 4u + 5 + 6);
  const double c = 0x1.211p+0, selu = files::function_of(Activation::kSelu).steepest();
  for (std::size_t i = 0; i < chain.slopes.size(); ++i) {
    const bool is_gelu = 4 <= i && i < 4 + 5;
    EXPECT_EQ(to_double(chain.slopes[i].low), is_gelu ? 1 - c : 0);
    EXPECT_EQ(to_double(chain.slopes[i].high), is_gelu ? c : 1);
  }
  const double factors[] = {1, 0.25, 1, selu};
  for (std::size_t k = 0; k < 4; ++k) {
    for (std::size_t i = 0; i < weights.layers[k].weights.size(); ++i)
      EXPECT_EQ(
          (chain.stages[k].entries[i] - check::Dyadic(weights.layers[k].weights[i]) * factors[k]).sign(), 0);
  }
}

/// phi with tanh, ReLU and a final sigmoid; rho with ReLU and SiLU.
const Network& mixed_set() {
  static const Network made = [] {
    Weights phi = mixed({3, 6, 5, 4}, {Activation::kTanh, Activation::kRelu}, 57);
    phi.end_in(Activation::kSigmoid);
    return tests::deep_set(phi, mixed({4, 5, 4, 1}, {Activation::kRelu, Activation::kSilu}, 58));
  }();
  return made;
}

const Json& mixed_certificate() {
  static const Json made = [] {
    CertifyOptions options;
    options.neighbours = 2;
    options.lower.rounds = 1;
    return lipschitz::certificate(mixed_set(), certify(mixed_set(), options));
  }();
  return made;
}

check::CheckResult check_mixed(Json changed, const Network& network = mixed_set()) {
  changed["content_sha256"] = files::content_sha256(changed);
  return check::check(changed, network);
}

TEST(MixedCertificate, OfADeepSetIsAcceptedAndStatesEachActivation) {
  const check::CheckResult result = check_mixed(mixed_certificate());
  EXPECT_TRUE(result.accepted) << result.reason;
  EXPECT_EQ(result.upper_bounds, 3 + 3);
  EXPECT_EQ(result.lower_bounds, 3);
  EXPECT_EQ(mixed_certificate()["bounds"][2]["upper_method"], "sdp");
  std::vector<std::string> ops;
  for (const Json& step : mixed_certificate()["network"]["weights"]["phi:default"]["chain"])
    ops.push_back(step["op"]);
  EXPECT_EQ(ops,
            (std::vector<std::string>{"linear", "tanh", "linear", "relu", "linear", "sigmoid", "linear"}));
}

TEST(MixedCertificate, IsRejectedWithActivationsExchangedOrLeftOut) {
  int tried = 0;
  for (const char* const part : {"phi:default", "rho:default"}) {
    const Json& chain = mixed_certificate()["network"]["weights"][part]["chain"];
    for (std::size_t k = 1; k < chain.size(); k += 2) {
      for (const char* const other : {"relu", "tanh", "sigmoid", "silu", "gelu"}) {
        if (chain[k]["op"] == other) continue;
        Json changed = mixed_certificate();
        changed["network"]["weights"][part]["chain"][k]["op"] = other;
        EXPECT_NE(check_mixed(changed).reason.find("chain"), std::string::npos)
            << part << " " << k << " " << other;
        ++tried;
      }
    }
    Json swapped = mixed_certificate();
    Json& steps = swapped["network"]["weights"][part]["chain"];
    std::swap(steps[1]["op"], steps[3]["op"]);
    EXPECT_FALSE(check_mixed(swapped).accepted);
    Json shorter = mixed_certificate();
    shorter["network"]["weights"][part]["chain"].erase(chain.size() - 1);
    shorter["network"]["weights"][part]["chain"].erase(chain.size() - 2);
    EXPECT_FALSE(check_mixed(shorter).accepted);
  }
  EXPECT_EQ(tried, 5 * 4);
}

TEST(MixedCertificate, IsRejectedWithAnyClaimBelowWhatIsProved) {
  for (const char* const list : {"bounds", "laws"}) {
    for (std::size_t i = 0; i < mixed_certificate()[list].size(); ++i) {
      Json changed = mixed_certificate();
      const double claim = std::nextafter(changed[list][i]["upper"].get<double>(), 0);
      changed[list][i]["upper"] = claim;
      changed[list][i]["upper_hex"] = files::hex_float(claim);
      EXPECT_NE(check_mixed(changed).reason.find("claims less than"), std::string::npos) << list << " " << i;
    }
  }
  // A proof for the activations in another order is refused.
  Network other = mixed_set();
  other.rho.at("default").set_activations({Activation::kSilu, Activation::kRelu});
  Json changed = mixed_certificate();
  Json& steps = changed["network"]["weights"]["rho:default"]["chain"];
  std::swap(steps[1]["op"], steps[3]["op"]);
  EXPECT_NE(check_mixed(changed, other).reason.find("does not show"), std::string::npos)
      << check_mixed(changed, other).reason;
}

TEST(MixedCertificate, OfTheProductCountsEachSlopeExactly) {
  unsigned seed = 60;
  for (const auto& [sizes, between] : mixtures()) {
    const Network network = tests::plain(mixed(sizes, between, seed++));
    const Json made = lipschitz::certificate(network, certify_mixed(network, UpperMethod::kProduct));
    EXPECT_TRUE(check_mixed(made, network).accepted);
    Json changed = made;
    const double claim = std::nextafter(made["bounds"][0]["upper"].get<double>(), 0);
    changed["bounds"][0]["upper"] = claim;
    changed["bounds"][0]["upper_hex"] = files::hex_float(claim);
    EXPECT_NE(check_mixed(changed, network).reason.find("less than the product"), std::string::npos);
  }
}

TEST(MixedCertificate, PastSkipConnectionsIsOfTheNumbersThatAreKept) {
  const Weights weights = with_skip({3, 8, 7, 2}, {3, 2}, {Activation::kSigmoid, Activation::kSigmoid}, 71);
  const Network network = tests::plain(weights);
  for (const UpperMethod method : {UpperMethod::kSdp, UpperMethod::kProduct}) {
    const Json made = lipschitz::certificate(network, certify_mixed(network, method));
    EXPECT_TRUE(check_mixed(made, network).accepted) << check_mixed(made, network).reason;
    EXPECT_NE(made["statement"].get<std::string>().find("tanh:n"), std::string::npos);
    for (const char* const other : {"sigmoid", "sigmoid:4", "tanh:5", "relu:5", "sigmoid:8"}) {
      Json changed = made;
      changed["network"]["weights"]["network"]["chain"][1]["op"] = other;
      EXPECT_NE(check_mixed(changed, network).reason.find("chain"), std::string::npos) << other;
    }
    // A bound for the network without kept entries does not hold here, because kept entries are steeper than a sigmoid.
    Weights all = weights;
    for (files::Layer& layer : all.layers) layer.kept = 0;
    Json changed = made;
    changed["bounds"] =
        lipschitz::certificate(tests::plain(all), certify_mixed(tests::plain(all), method))["bounds"];
    const std::string reason = check_mixed(changed, network).reason;
    EXPECT_NE(reason.find(method == UpperMethod::kSdp ? "does not show" : "less than the product"),
              std::string::npos)
        << reason;
  }
}

TEST(MixedCertificate, IsRejectedWithABoundByPartsOfAllInputs) {
  const Network network = tests::plain(mixed({2, 4, 4, 1}, {Activation::kRelu, Activation::kTanh}, 59));
  const Json made = lipschitz::certificate(network, certify_mixed(network));
  Json changed = made;
  changed["bounds"][0]["upper_method"] = "branch";
  EXPECT_FALSE(check_mixed(changed, network).accepted);
  changed["bounds"][0]["proof"] =
      Json::parse(R"({"rho": "0x1p-60", "form": null, "tree": "", "multipliers": [], "radius": []})");
  const std::string reason = check_mixed(changed, network).reason;
  EXPECT_NE(reason.find("a bound by parts for other activations than ReLU is for a box"), std::string::npos)
      << reason;
  CertifyOptions options;
  options.method = UpperMethod::kBranch;
  EXPECT_THROW(certify(network, options), std::invalid_argument);
}

}  // namespace
}  // namespace swarmcert
