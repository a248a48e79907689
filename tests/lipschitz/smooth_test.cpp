/// Bounds and certificates of networks with activations other than ReLU.
#include <cmath>

#include "lipschitz/certify.h"
#include "lipschitz/checker/check.h"
#include "lipschitz/checker/witness.h"
#include "lipschitz/lower/slope_estimate.h"
#include "lipschitz/networks.h"
#include "nn/base/content_hash.h"
#include "nn/base/json.h"

namespace swarmcert {
namespace {

using files::Activation;
using files::Json;
using files::Network;
using lipschitz::Certification;
using lipschitz::CertifyOptions;
using lipschitz::UpperMethod;

constexpr Activation kSmooth[] = {Activation::kTanh, Activation::kSigmoid, Activation::kSoftplus,
                                  Activation::kElu,  Activation::kSelu,    Activation::kSilu,
                                  Activation::kGelu};

files::Weights with(files::Weights weights, Activation activation) {
  tests::set_activation(weights, activation);
  return weights;
}

Certification certified_by(const Network& network, UpperMethod method = UpperMethod::kAuto) {
  CertifyOptions options;
  options.method = method;
  options.lower.rounds = 1;
  options.jobs = 1;
  return certify(network, options);
}

double upper_of(const Certification& found, const files::FunctionId& function) {
  for (const lipschitz::CertifiedBound& bound : found.bounds)
    if (bound.function == function && bound.block == "all") return bound.upper.value();
  ADD_FAILURE() << "no bound of " << function;
  return 0;
}

/// Returns the largest sampled slope of rho(phi(x) + s), where one neighbour moves and s is fixed.
double sampled_set_slope(const files::Weights& phi, const files::Weights& rho, std::mt19937& generator,
                         int samples) {
  const files::Evaluator<double> inner(phi), outer(rho);
  double steepest = 0;
  const auto random = [&generator] { return static_cast<double>(tests::random_number(generator)); };
  for (int s = 0; s < samples; ++s) {
    const double radius = std::exp2(static_cast<double>(generator() % 10) - 7);
    std::vector<double> x(static_cast<std::size_t>(phi.inputs())),
        y = x, others(static_cast<std::size_t>(rho.inputs()));
    for (std::size_t i = 0; i < x.size(); ++i) y[i] = (x[i] = 3 * random()) + radius * random();
    for (double& other : others) other = 2 * random();
    const auto value = [&](const std::vector<double>& input) {
      std::vector<double> sum = inner(input);
      for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += others[i];
      return outer(sum);
    };
    const std::vector<double> fx = value(x), fy = value(y);
    double moved = 0, changed = 0;
    for (std::size_t i = 0; i < x.size(); ++i) moved += (x[i] - y[i]) * (x[i] - y[i]);
    for (std::size_t i = 0; i < fx.size(); ++i) changed += (fx[i] - fy[i]) * (fx[i] - fy[i]);
    steepest = std::max(steepest, std::sqrt(changed / moved));
  }
  return steepest;
}

TEST(SmoothBounds, AreAboveEverySampledSlopeAndBelowTheProduct) {
  std::mt19937 generator(21);
  for (const Activation activation : kSmooth) {
    const files::ActivationFunction& function = files::function_of(activation);
    for (const std::vector<int>& sizes : {std::vector<int>{3, 12, 2}, {4, 10, 8, 1}, {1, 6, 6, 6, 2}}) {
      const files::Weights weights = with(tests::random_network(sizes, generator), activation);
      const Certification found = certified_by(tests::plain(weights));
      const double upper = upper_of(found, "network");
      const double sampled = tests::sampled_slope(weights, generator, 1500);
      EXPECT_GE(upper, sampled * (1 - 1e-9)) << function.op;
      EXPECT_GT(sampled, 0.02 * upper)
          << function.op << ": the sampled slopes are too small for a meaningful test";
      const double product = found.bounds[0].product.value();
      EXPECT_LT(upper, product) << function.op;
      EXPECT_TRUE(found.bounds[0].lower.witness);
    }
  }
}

TEST(SmoothBounds, OfDeepSetsAreAboveEverySampledSlopeForEveryPairOfActivations) {
  std::mt19937 generator(22);
  int with_program = 0;
  for (const Activation inner : kSmooth) {
    for (const Activation outer : {Activation::kRelu, Activation::kSigmoid, Activation::kSilu}) {
      const files::Weights phi = with(tests::random_network({3, 8, 7, 4}, generator), inner);
      const files::Weights rho = with(tests::random_network({4, 8, 1}, generator), outer);
      const Certification found = certified_by(tests::deep_set(phi, rho));
      const double upper = upper_of(found, "set:default:default");
      EXPECT_GE(upper, sampled_set_slope(phi, rho, generator, 400) * (1 - 1e-9))
          << files::function_of(inner).op << " " << files::function_of(outer).op;
      for (const lipschitz::CertifiedBound& bound : found.bounds) {
        if (bound.function != "set:default:default") continue;
        EXPECT_LT(bound.upper.value(), bound.product.value());
        EXPECT_EQ(bound.method, UpperMethod::kSdp);
        ++with_program;
      }
    }
  }
  EXPECT_EQ(with_program, 7 * 3);
}

TEST(SmoothBounds, TheSampledEstimateLiesBelowTheBoundAndAboveBlindSampling) {
  std::mt19937 generator(28);
  double closest = 0;
  for (const Activation activation : kSmooth) {
    const Network network = tests::plain(with(tests::random_network({3, 12, 2}, generator), activation));
    const Certification found = certified_by(network);
    const double estimate = lipschitz::slope_estimate(network, found.bounds[0], {}).value();
    EXPECT_LE(estimate, upper_of(found, "network") * (1 + 1e-9)) << files::function_of(activation).op;
    EXPECT_GE(estimate, 0.9 * tests::sampled_slope(*network.plain, generator, 500));
    closest = std::max(closest, estimate / upper_of(found, "network"));
  }
  EXPECT_GT(closest, 0.7);
  // tanh(tanh(x0 + 3 x1) + s), whose largest slopes are 1, 3 and sqrt 10, where x0 + 3 x1 = s = 0.
  Network set = tests::deep_set(tests::weights({tests::layer(1, 2, {1, 3}), tests::layer(1, 1, {1})}),
                                tests::weights({tests::layer(1, 1, {1}), tests::layer(1, 1, {1})}));
  tests::set_activation(set.phi.at("default"), Activation::kTanh);
  tests::set_activation(set.rho.at("default"), Activation::kTanh);
  const auto estimate_of = [&set](const std::string& block, const std::vector<double>& scale) {
    return lipschitz::slope_estimate(set, {"set:default:default", block, scale}, {}).value();
  };
  EXPECT_NEAR(estimate_of("all", {}), std::sqrt(10.0), 1e-3);
  EXPECT_NEAR(estimate_of("x0", {}), 1, 1e-3);
  EXPECT_NEAR(estimate_of("x1", {1, 2}), 6, 1e-2);
}

TEST(SmoothBounds, OneHiddenLayerOfSigmoidsHasAQuarterOfTheBoundOfRelu) {
  std::mt19937 generator(23);
  const files::Weights weights = tests::random_network({4, 16, 3}, generator);
  for (const UpperMethod method : {UpperMethod::kSdp, UpperMethod::kProduct}) {
    const double relu = upper_of(certified_by(tests::plain(weights), method), "network");
    const auto of = [&](Activation activation) {
      return upper_of(certified_by(tests::plain(with(weights, activation)), method), "network");
    };
    EXPECT_NEAR(of(Activation::kSigmoid), relu / 4, 1e-6 * relu);
    EXPECT_NEAR(of(Activation::kTanh), relu, 1e-6 * relu);
    EXPECT_NEAR(of(Activation::kSelu), 1.7580993408473766 * relu, 1e-6 * relu);
  }
}

TEST(SmoothBounds, TheStageBehindAnActivationIsMultipliedByItsSlope) {
  std::mt19937 generator(24);
  const files::Weights phi = tests::random_network({3, 4, 5}, generator),
                       rho = tests::random_network({5, 6, 1}, generator);
  const Network with_relu = tests::deep_set(phi, rho);
  const Network with_sigmoid =
      tests::deep_set(with(phi, Activation::kSigmoid), with(rho, Activation::kSigmoid));
  const auto plain = check::stages(with_relu, "set:default:default"),
             folded = check::stages(with_sigmoid, "set:default:default");
  ASSERT_EQ(folded.size(), 3u);
  for (std::size_t k = 0; k < folded.size(); ++k) {
    ASSERT_EQ(folded[k].entries.size(), plain[k].entries.size());
    for (std::size_t i = 0; i < folded[k].entries.size(); ++i)
      EXPECT_EQ((folded[k].entries[i] * (k == 0 ? 1.0 : 4.0) - plain[k].entries[i]).sign(), 0);
  }
  // Without a hidden layer in phi there is no activation before the product of phi's last and rho's first layer.
  const Network linear =
      tests::deep_set(tests::random_network({3, 5}, generator), with(rho, Activation::kSigmoid));
  const auto first = check::stages(linear, "set:default:default");
  ASSERT_EQ(first.size(), 2u);
  EXPECT_THROW(check::stages(tests::plain(with(phi, Activation::kGelu)), "network"), std::domain_error);
}

TEST(SmoothBounds, WhatIsForReluRefusesOtherActivations) {
  std::mt19937 generator(25);
  const Network network = tests::plain(with(tests::random_network({2, 4, 1}, generator), Activation::kTanh));
  CertifyOptions options;
  options.method = UpperMethod::kBranch;
  EXPECT_THROW(certify(network, options), std::invalid_argument);
  EXPECT_THROW(check::local_function(network, "network", "all", {}, check::Matrix(0, 0)),
               std::invalid_argument);
}

/// A deep set of tanh and sigmoid, with a law.
const Network& smooth_set() {
  static const Network made = [] {
    std::mt19937 generator(26);
    return tests::deep_set(with(tests::random_network({3, 6, 4}, generator), Activation::kTanh),
                           with(tests::random_network({4, 5, 1}, generator), Activation::kSigmoid));
  }();
  return made;
}

const Json& smooth_certificate() {
  static const Json made = [] {
    CertifyOptions options;
    options.neighbours = 2;
    options.lower.rounds = 1;
    return lipschitz::certificate(smooth_set(), certify(smooth_set(), options));
  }();
  return made;
}

check::CheckResult checked(Json changed, const Network& network = smooth_set()) {
  changed["content_sha256"] = files::content_sha256(changed);
  return check::check(changed, network);
}

TEST(SmoothCertificate, IsAcceptedWithLowerBounds) {
  const check::CheckResult result = checked(smooth_certificate());
  EXPECT_TRUE(result.accepted) << result.reason;
  EXPECT_EQ(result.lower_bounds, 3);
  EXPECT_EQ(result.upper_bounds, 3 + 3);  // phi, rho, the set; three laws
  EXPECT_EQ(smooth_certificate()["network"]["weights"]["phi:default"]["chain"][1]["op"], "tanh");
  EXPECT_EQ(smooth_certificate()["bounds"][2]["upper_method"], "sdp");
}

TEST(SmoothCertificate, IsRejectedWithAnotherActivationInTheChain) {
  int tried = 0;
  for (const char* const part : {"phi:default", "rho:default"}) {
    const std::string own = smooth_certificate()["network"]["weights"][part]["chain"][1]["op"];
    for (const char* const other : {"relu", "tanh", "sigmoid", "gelu", "selu", "clamp", "mish", ""}) {
      if (own == other) continue;
      Json changed = smooth_certificate();
      changed["network"]["weights"][part]["chain"][1]["op"] = other;
      EXPECT_NE(checked(changed).reason.find("chain"), std::string::npos) << part << " " << other;
      EXPECT_FALSE(checked(changed).accepted) << part << " " << other;
      ++tried;
    }
  }
  EXPECT_EQ(tried, 14);
}

TEST(SmoothCertificate, IsRejectedWithAnyClaimBelowWhatIsProved) {
  for (const char* const list : {"bounds", "laws"}) {
    for (std::size_t i = 0; i < smooth_certificate()[list].size(); ++i) {
      Json changed = smooth_certificate();
      const double claim = std::nextafter(changed[list][i]["upper"].get<double>(), 0);
      changed[list][i]["upper"] = claim;
      changed[list][i]["upper_hex"] = files::hex_float(claim);
      EXPECT_NE(checked(changed).reason.find("claims less than"), std::string::npos) << list << " " << i;
    }
  }
  // It is also refused for ReLU, whose slopes are four times as steep: stating ReLU must not drop the factor 1/4.
  const Network relu = tests::deep_set(smooth_set().phi.at("default"),
                                       with(smooth_set().rho.at("default"), Activation::kRelu));
  Json changed = smooth_certificate();
  changed["network"]["weights"]["rho:default"]["chain"][1]["op"] = "relu";
  EXPECT_NE(checked(changed, relu).reason.find("does not show"), std::string::npos);
}

TEST(SmoothCertificate, OfTheProductCountsTheSlopesExactly) {
  std::mt19937 generator(27);
  for (const Activation activation : kSmooth) {
    const Network network = tests::plain(with(tests::random_network({3, 5, 4, 2}, generator), activation));
    const Json made = lipschitz::certificate(network, certified_by(network, UpperMethod::kProduct));
    EXPECT_EQ(made["bounds"][0]["upper_method"], "product");
    EXPECT_TRUE(checked(made, network).accepted);
    Json changed = made;
    const double claim = std::nextafter(made["bounds"][0]["upper"].get<double>(), 0);
    changed["bounds"][0]["upper"] = claim;
    changed["bounds"][0]["upper_hex"] = files::hex_float(claim);
    EXPECT_FALSE(checked(changed, network).accepted) << files::function_of(activation).op;
  }
}

TEST(SmoothCertificate, IsRejectedWithBoundsByPartsOfAllInputs) {
  const auto rejects = [](const std::function<void(Json&)>& change, const std::string& reason) {
    Json changed = smooth_certificate();
    change(changed);
    const check::CheckResult result = checked(changed);
    EXPECT_FALSE(result.accepted) << reason;
    EXPECT_NE(result.reason.find(reason), std::string::npos) << result.reason;
  };
  rejects([&](Json& c) { c["bounds"][0]["upper_method"] = "branch"; }, "proof");
  rejects(
      [&](Json& c) {
        c["bounds"][0]["upper_method"] = "branch";
        c["bounds"][0]["proof"] =
            Json::parse(R"({"rho": "0x1p-60", "form": null, "tree": "", "multipliers": [], "radius": []})");
      },
      "a bound by parts for other activations than ReLU is for a box");
  rejects([&](Json& c) { c["bounds"][0]["upper_method"] = "local_sdp"; },
          "slopes on a box of a bound without one");
}

TEST(SmoothCertificate, OfTheProductIsRejectedForABlockThatIsNone) {
  const Json made = lipschitz::certificate(smooth_set(), certified_by(smooth_set(), UpperMethod::kProduct));
  Json changed = made;
  changed["bounds"][0]["block"] = "ll";
  EXPECT_TRUE(checked(made).accepted);
  EXPECT_NE(checked(changed).reason.find("no block"), std::string::npos);
}

TEST(SmoothCertificate, IsOfTheActivationThatItCarriesAndOfNoOther) {
  Network other = smooth_set();
  for (files::Weights* const weights : {&other.phi.at("default"), &other.rho.at("default")})
    tests::set_activation(*weights, Activation::kRelu);
  EXPECT_TRUE(check::check(smooth_certificate()).accepted);
  EXPECT_NE(checked(smooth_certificate(), other).reason.find("chain"), std::string::npos);
}

TEST(SmoothCertificate, OptionsThatAreLeftOpenAreThoseOfTheCertificate) {
  Network network = smooth_set();
  network.options.activation = "tanh";
  network.options.phi_order = {"fc1", "fc2"};
  lipschitz::CertifyOptions options;
  options.lower.rounds = 1;
  const Json made = lipschitz::certificate(network, certify(network, options));
  files::NetworkArguments open;
  open.phi = open.rho = "net.pth";
  EXPECT_EQ(check::with_stated_options(made, open).activation, "tanh");
  EXPECT_EQ(check::with_stated_options(made, open).phi_order.size(), 2u);
  open.activation = "relu";
  EXPECT_EQ(check::with_stated_options(made, open).activation, "relu");
  EXPECT_EQ(check::with_stated_options(Json(), open).activation, "relu");
}

}  // namespace
}  // namespace swarmcert
