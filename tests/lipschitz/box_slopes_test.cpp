/// Networks with activations other than ReLU on a box: values, and bounds from the slopes there.
#include <algorithm>
#include <cmath>
#include <optional>

#include "lipschitz/boxes.h"
#include "lipschitz/checker/centred_form.h"
#include "lipschitz/checker/check.h"
#include "lipschitz/lower/slope_estimate.h"
#include "lipschitz/networks.h"
#include "lipschitz/values/range.h"
#include "lipschitz/values/value_bounds.h"
#include "nn/weights/functions.h"

namespace swarmcert {
namespace {

using check::to_double;
using files::Activation;
using files::Network;
using files::Weights;
using lipschitz::Box;
using lipschitz::Certification;
using lipschitz::UpperMethod;
using tests::bound_of;
using tests::cube;
using tests::Domain;
using tests::intervals;
using tests::on_box;
using tests::with;

constexpr Activation kSmooth[] = {Activation::kTanh, Activation::kSigmoid, Activation::kSoftplus,
                                  Activation::kElu,  Activation::kSelu,    Activation::kSilu,
                                  Activation::kGelu};

/// Returns networks of three inputs with several activations; some end with an activation, followed by an identity
/// layer, and some keep entries past the activations.
std::vector<Weights> mixtures(std::mt19937& generator) {
  using A = Activation;
  struct Mixture {
    std::vector<int> sizes;
    std::vector<A> between;
    std::optional<A> end;
    std::vector<int> kept = {};
  };
  const Mixture all[] = {{{3, 10, 8, 2}, {A::kTanh, A::kRelu}, {}},
                         {{3, 10, 8, 2}, {A::kRelu, A::kTanh}, {}},
                         {{3, 8, 6, 2}, {A::kRelu, A::kRelu}, A::kTanh},
                         {{3, 8, 6, 6, 2}, {A::kGelu, A::kSelu, A::kSigmoid}, {}},
                         {{3, 8, 6, 2}, {A::kSilu, A::kSoftplus}, A::kSigmoid},
                         {{3, 8, 6, 2}, {A::kElu, A::kRelu}, A::kGelu},
                         {{3, 2}, {}, A::kSilu},
                         {{3, 10, 8, 2}, {A::kTanh, A::kGelu}, {}, {4, 3}},
                         {{3, 9, 8, 2}, {A::kSigmoid, A::kRelu}, A::kSelu, {3}},
                         {{3, 8, 9, 7, 2}, {A::kSilu, A::kSilu, A::kSoftplus}, {}, {2, 2, 3}}};
  std::vector<Weights> result;
  for (const Mixture& mixture : all) {
    result.push_back(tests::random_network(mixture.sizes, generator));
    result.back().set_activations(mixture.between);
    for (std::size_t k = 0; k < mixture.kept.size(); ++k) result.back().layers[k].kept = mixture.kept[k];
    if (mixture.end) result.back().end_in(*mixture.end);
  }
  return result;
}

/// The same with a layer that sorts.
std::vector<Weights> sorting_mixtures(std::mt19937& generator) {
  using A = Activation;
  std::vector<Weights> result;
  for (const std::vector<A>& between : {std::vector<A>{A::kTanh, A::kMaxMinPairs, A::kRelu},
                                        {A::kMaxMinHalves, A::kSigmoid, files::group_sort(3)}}) {
    result.push_back(tests::random_network({3, 8, 8, 6, 2}, generator));
    result.back().set_activations(between);
  }
  result.push_back(tests::random_network({3, 8, 6}, generator));
  result.back().set_activations({A::kSilu});
  result.back().end_in(files::group_sort(2));
  return result;
}

std::vector<double> point_in(const Box& box, std::mt19937& generator) {
  std::vector<double> x;
  for (std::size_t k = 0; k < box.lower.size(); ++k) {
    const double share = (1 + static_cast<double>(tests::random_number(generator))) / 2;
    x.push_back(box.lower[k] + share * (box.upper[k] - box.lower[k]));
  }
  return x;
}

double distance(const std::vector<double>& x, const std::vector<double>& y) {
  double square = 0;
  for (std::size_t i = 0; i < x.size(); ++i) square += (x[i] - y[i]) * (x[i] - y[i]);
  return std::sqrt(square);
}

/// Returns the largest of `samples` slopes between points of the box, both far apart and close together.
double sampled_slope(const Weights& weights, const Box& box, std::mt19937& generator, int samples) {
  const files::Evaluator<double> f(weights);
  double steepest = 0;
  for (int s = 0; s < samples; ++s) {
    const std::vector<double> x = point_in(box, generator), other = point_in(box, generator);
    const double share = std::exp2(-static_cast<double>(generator() % 12));
    std::vector<double> y = x;
    for (std::size_t k = 0; k < y.size(); ++k) y[k] += share * (other[k] - x[k]);
    if (distance(x, y) > 0) steepest = std::max(steepest, distance(f(x), f(y)) / distance(x, y));
  }
  return steepest;
}

TEST(LayersOnBox, ContainEverySampledValueOfEveryActivation) {
  std::mt19937 generator(81);
  std::vector<Activation> all(std::begin(kSmooth), std::end(kSmooth));
  for (const Activation other :
       {Activation::kRelu, Activation::kMaxMinHalves, Activation::kMaxMinPairs, files::group_sort(3)})
    all.push_back(other);
  for (const Activation activation : all) {
    for (const double radius : {0.01, 0.5, 4.0}) {
      const Weights weights = with(tests::random_network({3, 12, 6, 2}, generator), activation);
      const Box box = cube(3, radius);
      const check::Intervals output = check::layers_on_box(weights, intervals(box)).back();
      const files::Evaluator<double> f(weights);
      for (int s = 0; s < 500; ++s) {
        const std::vector<double> value = f(point_in(box, generator));
        for (std::size_t i = 0; i < value.size(); ++i) {
          EXPECT_GE(value[i], to_double(output.lower[i]) - 1e-12) << files::function_of(activation).op;
          EXPECT_LE(value[i], to_double(output.upper[i]) + 1e-12) << files::function_of(activation).op;
        }
      }
    }
  }
}

TEST(LayersOnBox, ContainEveryLayerOfNetworksWithSeveralActivations) {
  std::mt19937 generator(91);
  std::vector<Weights> all = mixtures(generator);
  for (Weights& other : sorting_mixtures(generator)) all.push_back(std::move(other));
  for (const Weights& weights : all) {
    for (const double radius : {0.01, 0.5, 4.0}) {
      const Box box = cube(3, radius);
      const std::vector<check::Intervals> layers = check::layers_on_box(weights, intervals(box));
      ASSERT_EQ(layers.size(), weights.layers.size());
      for (std::size_t k = 0; k < layers.size(); ++k) {
        Weights beginning = weights;
        beginning.layers.resize(k + 1);
        const files::Evaluator<double> f(beginning);
        for (int s = 0; s < 200; ++s) {
          const std::vector<double> value = f(point_in(box, generator));
          for (std::size_t i = 0; i < value.size(); ++i) {
            EXPECT_GE(value[i], to_double(layers[k].lower[i]) - 1e-12) << weights.activation_names() << k;
            EXPECT_LE(value[i], to_double(layers[k].upper[i]) + 1e-12) << weights.activation_names() << k;
          }
        }
      }
    }
  }
}

/// The slope range of each layer contains the sampled difference quotients of its own activation.
TEST(SlopesOnBox, ContainEverySampledQuotientOfEachLayersOwnActivation) {
  std::mt19937 generator(92);
  for (const Weights& weights : mixtures(generator)) {
    const Box box = cube(3, 0.5);
    const auto slopes = check::slopes_on_box(weights, intervals(box));
    ASSERT_EQ(slopes.size(), weights.layers.size() - 1);
    for (std::size_t k = 0; k < slopes.size(); ++k) {
      Weights beginning = weights;
      beginning.layers.resize(k + 1);
      const files::Evaluator<double> f(beginning);
      const files::ActivationFunction& function = files::function_of(weights.layers[k].activation);
      for (int s = 0; s < 300; ++s) {
        const std::vector<double> x = f(point_in(box, generator)), y = f(point_in(box, generator));
        for (std::size_t i = 0; i < x.size(); ++i) {
          if (std::abs(x[i] - y[i]) < 1e-3) continue;
          const bool is_kept = i + static_cast<std::size_t>(weights.layers[k].kept) >= x.size();
          const double quotient = is_kept ? 1 : (function.value(x[i]) - function.value(y[i])) / (x[i] - y[i]);
          EXPECT_GE(quotient, to_double(slopes[k][i].lower) - 1e-11) << function.op << " in layer " << k;
          EXPECT_LE(quotient, to_double(slopes[k][i].upper) + 1e-11) << function.op << " in layer " << k;
        }
      }
    }
  }
}

/// In a small box the error of the linear form is quadratic in its size, so stated and attained ranges nearly agree.
TEST(RangesOnBox, ContainWhatIsAttainedAndComeCloserAsTheBoxShrinks) {
  std::mt19937 generator(82);
  for (const Activation activation : kSmooth) {
    const Network network = tests::plain(with(tests::random_network({3, 10, 10, 2}, generator), activation));
    double excess = 1e9;
    for (const double radius : {1.0, 0.01, 0.0001}) {
      const auto ranges = lipschitz::ranges(network, {{"network", cube(3, radius)}}, {}, {});
      ASSERT_EQ(ranges.size(), 2u);
      double widest = 1;
      for (const lipschitz::CertifiedRange& range : ranges) {
        EXPECT_LE(range.lower, range.least.value);
        EXPECT_GE(range.upper, range.greatest.value);
        ASSERT_EQ(range.least.points.size(), 1u);
        EXPECT_LT(range.least.value, range.greatest.value);
        widest = std::max(widest, (range.upper - range.lower) / (range.greatest.value - range.least.value));
      }
      EXPECT_LT(widest, excess) << files::function_of(activation).op << " " << radius;
      excess = widest;
    }
    EXPECT_LT(excess, 1.2) << files::function_of(activation).op << ": much wider than what 200 steps find";
  }
}

TEST(LocalSlopes, NoneOf100000SlopesInTheBoxIsAboveAndTheGlobalBoundIsNotBelow) {
  std::mt19937 generator(83);
  long tried = 0;
  double closest = 0, most_gained = 1;
  for (const Activation activation : kSmooth) {
    for (const double radius : {0.05, 0.5, 3.0}) {
      const Network network = tests::plain(with(tests::random_network({3, 12, 8, 2}, generator), activation));
      const Domain domain = {{"network", cube(3, radius)}};
      const lipschitz::CertifiedBound local = bound_of(certify(network, on_box(domain)), "network");
      const double global = bound_of(certify(network, on_box({})), "network").upper.value();
      lipschitz::SlopeEstimateOptions climbing;
      climbing.domain = domain;
      const double found = std::max(sampled_slope(*network.plain, domain.at("network"), generator, 5000),
                                    lipschitz::slope_estimate(network, local, climbing).value());
      tried += 5000;
      const std::string where = files::function_of(activation).op + " " + std::to_string(radius);
      EXPECT_LE(found, local.upper.value() * (1 + 1e-7)) << where;
      EXPECT_LE(local.upper.value(), global * (1 + 1e-6)) << where;
      closest = std::max(closest, found / local.upper.value());
      most_gained = std::max(most_gained, global / local.upper.value());
    }
  }
  EXPECT_GE(tried, 100000);
  EXPECT_GT(closest, 0.9) << "the slopes found are too small for a meaningful test";
  EXPECT_GT(most_gained, 1.3) << "the box never improves a bound";
}

TEST(LocalSlopes, OfSeveralActivationsAreAboveAllSampledOnesAndCheckedAgain) {
  std::mt19937 generator(93);
  std::vector<Weights> all = mixtures(generator);
  const std::size_t with_slopes = all.size();
  for (Weights& other : sorting_mixtures(generator)) all.push_back(std::move(other));
  std::size_t by_program = 0;
  for (std::size_t n = 0; n < all.size(); ++n) {
    const Network network = tests::plain(all[n]);
    const std::string names = all[n].activation_names();
    for (const double radius : {0.02, 0.5}) {
      const Domain domain = {{"network", cube(3, radius)}};
      Certification found = certify(network, on_box(domain));
      const lipschitz::CertifiedBound& local = bound_of(found, "network");
      const double global = bound_of(certify(network, on_box({})), "network").upper.value();
      lipschitz::SlopeEstimateOptions climbing;
      climbing.domain = domain;
      const double steepest = std::max(sampled_slope(all[n], domain.at("network"), generator, 3000),
                                       lipschitz::slope_estimate(network, local, climbing).value());
      EXPECT_LE(steepest, local.upper.value() * (1 + 1e-7)) << names << radius;
      EXPECT_LE(local.upper.value(), global * (1 + 1e-6)) << names << radius;
      EXPECT_TRUE(n < with_slopes || local.method != UpperMethod::kLocalSdp) << names;
      by_program += local.method == UpperMethod::kLocalSdp ? 1 : 0;
      found.values = certified_values(network, domain, {}, {1, false, false, 0});
      EXPECT_EQ(found.values.size(), 1u);
      const check::CheckResult result = check::check(lipschitz::certificate(network, found), network);
      EXPECT_TRUE(result.accepted) << names << radius << ": " << result.reason;
    }
  }
  EXPECT_GE(by_program, with_slopes) << "the slopes on the box hardly ever improve a bound";
}

/// A chain of single neurons behind weights w_k has derivatives in prod |w_k| [prod a_k, prod b_k], where [a_k, b_k]
/// are the slopes on the box, here positive. The bound is loose only by the width of these ranges, whatever the depth.
TEST(LocalSlopes, OfAChainOfSingleNeuronsLieBetweenTheProductsOfLeastAndGreatestSlopes) {
  std::mt19937 generator(96);
  std::vector<Activation> between(std::begin(kSmooth), std::end(kSmooth));
  between.push_back(Activation::kRelu);
  int tried = 0;
  for (int n = 0; n < 40; ++n) {
    std::shuffle(between.begin(), between.end(), generator);
    Weights weights = tests::random_network(std::vector<int>(between.size() + 1, 1), generator);
    double product = 1;
    for (files::Layer& layer : weights.layers) {
      layer.weights[0] = std::copysign(0.5 + std::abs(layer.weights[0]), layer.weights[0]);
      product *= std::abs(layer.weights[0]);
    }
    weights.set_activations({between.begin(), between.end() - 1});
    const Domain domain = {{"network", cube(1, 0.02)}};
    double least = product, greatest = product;
    for (const std::vector<check::Interval>& layer :
         check::slopes_on_box(weights, intervals(domain.at("network")))) {
      least *= std::max(0.0, to_double(layer[0].lower));
      greatest *= to_double(layer[0].upper);
    }
    if (!(least > 1e-3)) continue;  // an activation is not increasing on the whole box
    const Network network = tests::plain(weights);
    const lipschitz::CertifiedBound bound = bound_of(certify(network, on_box(domain)), "network");
    EXPECT_GE(sampled_slope(weights, domain.at("network"), generator, 50), least * (1 - 1e-9));
    EXPECT_GE(bound.upper.value(), least);
    EXPECT_LE(bound.upper.value(), greatest * (1 + 1e-6));
    ++tried;
  }
  EXPECT_GE(tried, 5) << "too few chains are increasing";
}

TEST(LocalSlopes, ComeCloserToTheSteepestOneAsTheBoxShrinks) {
  std::mt19937 generator(84);
  for (const Activation activation : kSmooth) {
    const Network network = tests::plain(with(tests::random_network({3, 10, 8, 2}, generator), activation));
    double ratio = 1e9;
    for (const double radius : {1.0, 0.05, 0.002}) {
      const Domain domain = {{"network", cube(3, radius)}};
      const lipschitz::CertifiedBound bound = bound_of(certify(network, on_box(domain)), "network");
      lipschitz::SlopeEstimateOptions climbing;
      climbing.domain = domain;
      const double now = bound.upper.value() / lipschitz::slope_estimate(network, bound, climbing).value();
      EXPECT_LT(now, ratio) << files::function_of(activation).op << " " << radius;
      ratio = now;
    }
    EXPECT_LT(ratio, 1.02) << files::function_of(activation).op;
  }
}

TEST(LocalSlopes, OfADeepSetAreThoseOfPhiOnTheBoxAndOfRhoEverywhere) {
  std::mt19937 generator(85);
  for (const Activation outer : {Activation::kRelu, Activation::kTanh, Activation::kGelu}) {
    const Weights phi = with(tests::random_network({3, 8, 6, 4}, generator), Activation::kTanh);
    const Weights rho = with(tests::random_network({4, 8, 1}, generator), outer);
    const Network network = tests::deep_set(phi, rho);
    const Domain domain = {{"phi:default", cube(3, 0.2)}};
    const Certification found = certify(network, on_box(domain));
    const lipschitz::CertifiedBound& bound = bound_of(found, "set:default:default");
    EXPECT_EQ(bound.method, UpperMethod::kLocalSdp);
    EXPECT_LT(bound.upper.value(),
              bound_of(certify(network, on_box({})), "set:default:default").upper.value());
    EXPECT_EQ(bound_of(found, "rho:default").domain, "global");
    const files::Evaluator<double> inner(phi), behind(rho);
    for (int s = 0; s < 3000; ++s) {
      const std::vector<double> x = point_in(domain.at("phi:default"), generator),
                                y = point_in(domain.at("phi:default"), generator);
      std::vector<double> hx = inner(x), hy = inner(y);
      for (std::size_t i = 0; i < hx.size(); ++i) {
        const double others = 3 * static_cast<double>(tests::random_number(generator));
        hx[i] += others;
        hy[i] += others;
      }
      EXPECT_LE(distance(behind(hx), behind(hy)), bound.upper.value() * distance(x, y) * (1 + 1e-9));
    }
  }
}

TEST(LocalSlopes, GiveAProductWhereNoProgramIsAskedFor) {
  std::mt19937 generator(86);
  int local = 0;
  for (const Activation activation : kSmooth) {
    const Network network = tests::plain(with(tests::random_network({3, 10, 8, 2}, generator), activation));
    Box far = cube(3, 0.1);  // no tanh of the first layer reaches its steepest slope here
    for (std::vector<double>* const side : {&far.lower, &far.upper})
      for (double& end : *side) end += 10;
    const Domain domain = {{"network", far}};
    const auto product = bound_of(certify(network, on_box(domain, UpperMethod::kProduct)), "network");
    const auto best = bound_of(certify(network, on_box(domain)), "network");
    EXPECT_LE(product.upper.value(), product.product.value());
    EXPECT_LE(best.upper.value(), product.upper.value());
    local += product.method == UpperMethod::kLocalProduct ? 1 : 0;
  }
  EXPECT_GE(local, 4) << "ELU, SELU and softplus are steepest wherever they are positive";
}

}  // namespace
}  // namespace swarmcert
