/// Networks of other activations than ReLU on a box: values, bounds from the slopes there, and their certificates.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>

#include "lipschitz/attained_values.h"
#include "lipschitz/certify.h"
#include "lipschitz/checker/centred_form.h"
#include "lipschitz/checker/check.h"
#include "lipschitz/checker/statement.h"
#include "lipschitz/networks.h"
#include "lipschitz/range.h"
#include "lipschitz/slope_estimate.h"
#include "lipschitz/value_bounds.h"
#include "nn/base/content_hash.h"
#include "nn/base/json.h"
#include "nn/weights/functions.h"
#include "nn/weights/invariants.h"

namespace swarmcert {
namespace {

using check::to_double;
using files::Activation;
using files::Json;
using files::Network;
using files::Weights;
using lipschitz::Box;
using lipschitz::Certification;
using lipschitz::CertifyOptions;
using lipschitz::UpperMethod;
using Domain = std::map<std::string, Box>;

constexpr Activation kSmooth[] = {Activation::kTanh, Activation::kSigmoid, Activation::kSoftplus,
                                  Activation::kElu,  Activation::kSelu,    Activation::kSilu,
                                  Activation::kGelu};

Weights with(Weights weights, Activation activation) {
  tests::set_activation(weights, activation);
  return weights;
}

/// Networks of three inputs with several activations, and some with one at the end, behind which is an identity layer.
std::vector<Weights> mixtures(std::mt19937& generator) {
  using A = Activation;
  struct Mixture {
    std::vector<int> sizes;
    std::vector<A> between;
    std::optional<A> end;
  };
  const Mixture all[] = {{{3, 10, 8, 2}, {A::kTanh, A::kRelu}, {}},
                         {{3, 10, 8, 2}, {A::kRelu, A::kTanh}, {}},
                         {{3, 8, 6, 2}, {A::kRelu, A::kRelu}, A::kTanh},
                         {{3, 8, 6, 6, 2}, {A::kGelu, A::kSelu, A::kSigmoid}, {}},
                         {{3, 8, 6, 2}, {A::kSilu, A::kSoftplus}, A::kSigmoid},
                         {{3, 8, 6, 2}, {A::kElu, A::kRelu}, A::kGelu},
                         {{3, 2}, {}, A::kSilu}};
  std::vector<Weights> result;
  for (const Mixture& mixture : all) {
    result.push_back(tests::random_network(mixture.sizes, generator));
    result.back().set_activations(mixture.between);
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

/// Half as wide as `radius` says, around a point that is not symmetric.
Box cube(int inputs, double radius) {
  Box box;
  for (int k = 0; k < inputs; ++k) {
    const double middle = 0.3 - 0.2 * k;
    box.lower.push_back(middle - radius);
    box.upper.push_back(middle + radius);
  }
  return box;
}

std::vector<double> point_in(const Box& box, std::mt19937& generator) {
  std::vector<double> x;
  for (std::size_t k = 0; k < box.lower.size(); ++k) {
    const double share = (1 + static_cast<double>(tests::random_number(generator))) / 2;
    x.push_back(box.lower[k] + share * (box.upper[k] - box.lower[k]));
  }
  return x;
}

check::Intervals intervals(const Box& box) {
  return {{box.lower.begin(), box.lower.end()}, {box.upper.begin(), box.upper.end()}};
}

double distance(const std::vector<double>& x, const std::vector<double>& y) {
  double square = 0;
  for (std::size_t i = 0; i < x.size(); ++i) square += (x[i] - y[i]) * (x[i] - y[i]);
  return std::sqrt(square);
}

/// The steepest of `samples` slopes between points of the box, far apart and close together.
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

CertifyOptions on_box(const Domain& domain, UpperMethod method = UpperMethod::kAuto) {
  CertifyOptions options;
  options.domain = domain;
  options.method = method;
  options.lower.rounds = 1;
  options.jobs = 1;
  return options;
}

const lipschitz::CertifiedBound& bound_of(const Certification& found, const std::string& function) {
  for (const lipschitz::CertifiedBound& bound : found.bounds)
    if (bound.function == function && bound.block == "all") return bound;
  throw std::logic_error("no bound of " + function);
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

/// Each layer's slopes are those of its own activation, between the quotients that samples show.
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
          const double quotient = (function.value(x[i]) - function.value(y[i])) / (x[i] - y[i]);
          EXPECT_GE(quotient, to_double(slopes[k][i].lower) - 1e-11) << function.op << " in layer " << k;
          EXPECT_LE(quotient, to_double(slopes[k][i].upper) + 1e-11) << function.op << " in layer " << k;
        }
      }
    }
  }
}

/// In a small box the linear form is exact up to the square of its size: what is stated is what is attained.
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
    EXPECT_LT(excess, 1.2) << files::function_of(activation).op << ": 200 steps find most of a width";
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
  EXPECT_GT(closest, 0.9) << "the slopes are too flat to mean anything";
  EXPECT_GT(most_gained, 1.3) << "the box is never used";
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
  EXPECT_GE(by_program, with_slopes) << "the slopes on the box hardly ever serve";
}

/// A chain of single neurons behind weights w_k has derivatives in prod |w_k| [prod a_k, prod b_k], [a_k, b_k] the
/// slopes on the box, here positive: nothing is lost but the width of those, however many activations there are.
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
    if (!(least > 1e-3)) continue;  // an activation that does not rise all over the box
    const Network network = tests::plain(weights);
    const lipschitz::CertifiedBound bound = bound_of(certify(network, on_box(domain)), "network");
    EXPECT_GE(sampled_slope(weights, domain.at("network"), generator, 50), least * (1 - 1e-9));
    EXPECT_GE(bound.upper.value(), least);
    EXPECT_LE(bound.upper.value(), greatest * (1 + 1e-6));
    ++tried;
  }
  EXPECT_GE(tried, 5) << "too few chains rise";
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
    Box far = cube(3, 0.1);  // where no tanh of the first layer is at its steepest
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

/// A deep set of tanh and GELU on a box, with laws and values.
struct Made {
  Network network;
  Json certificate;
};

const Made& made() {
  static const Made result = [] {
    std::mt19937 generator(87);
    const Network network =
        tests::deep_set(with(tests::random_network({3, 6, 4}, generator), Activation::kTanh),
                        with(tests::random_network({4, 5, 2}, generator), Activation::kGelu));
    CertifyOptions options = on_box({{"phi:default", cube(3, 0.25)}});
    options.neighbours = 2;
    Certification found = certify(network, options);
    const std::map<std::string, double> rho_bound = {
        {"default", bound_of(found, "rho:default").upper.value()}};
    found.values = certified_values(network, options.domain, rho_bound, {2, false, false, 0});
    return Made{network, lipschitz::certificate(network, found)};
  }();
  return result;
}

std::string reason(Json changed) {
  changed["content_sha256"] = files::content_sha256(changed);
  const check::CheckResult result = check::check(changed, made().network);
  return result.accepted ? "accepted" : result.reason;
}

/// The next double towards `goal`, in both notations.
void move(Json& entry, const std::string& key, double goal) {
  const double moved = std::nextafter(entry[key].get<double>(), goal);
  entry[key] = moved;
  entry[key + "_hex"] = files::hex_float(moved);
}

TEST(BoxCertificate, IsAcceptedWithBoundsOfTheBox) {
  EXPECT_EQ(reason(made().certificate), "accepted");
  int local = 0;
  for (const Json& bound : made().certificate["bounds"])
    local += bound["upper_method"] == "local_sdp" ? 1 : 0;
  EXPECT_EQ(local, 2);  // phi and the set
  EXPECT_EQ(made().certificate["laws"][0]["domain"], "box");
  EXPECT_EQ(made().certificate["values"].size(), 2u);  // one neighbour, two
}

TEST(BoxCertificate, IsRefusedWithAnyBoundOneUnitBelowWhatIsProved) {
  for (const char* const list : {"bounds", "laws"}) {
    for (std::size_t i = 0; i < made().certificate[list].size(); ++i) {
      Json changed = made().certificate;
      move(changed[list][i], "upper", 0);
      EXPECT_NE(reason(changed).find("claims less than"), std::string::npos) << list << " " << i;
    }
  }
  for (std::size_t i = 0; i < made().certificate["bounds"].size(); ++i) {
    const Json& proof = made().certificate["bounds"][i]["proof"];
    if (proof.is_null()) continue;
    Json changed = made().certificate;
    const double rho = files::parse_hex_float(proof["rho"].get<std::string>());
    changed["bounds"][i]["proof"]["rho"] = files::hex_float(rho * (1 - 1e-3));
    EXPECT_NE(reason(changed).find("does not show"), std::string::npos) << i;
  }
}

std::vector<double> numbers(const Json& text) {
  std::vector<double> result;
  const std::string words = text;
  const char* at = words.c_str();
  for (char* end = nullptr;; at = end) {
    const double x = std::strtod(at, &end);
    if (end == at) return result;
    result.push_back(x);
  }
}

Json joined(const std::vector<double>& values) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : " ") + files::hex_float(value);
  return text;
}

TEST(BoxCertificate, IsRefusedWithAnyStatedValueOneUnitInwards) {
  int tried = 0;
  const auto expect_refusal = [&](const std::vector<std::string>& path, const Json& changed_value) {
    Json changed = made().certificate;
    Json* at = &changed["values"][0];
    for (const std::string& key : path)
      at = at->is_array() ? &(*at)[static_cast<std::size_t>(std::stoi(key))] : &(*at)[key];
    *at = changed_value;
    EXPECT_NE(reason(changed), "accepted");
    ++tried;
  };
  const Json& values = made().certificate["values"][0];
  for (const auto& [side, goal] : {std::pair{"lower", 1e9}, {"upper", -1e9}}) {
    for (const auto& [name, layers] : values["networks"].items()) {
      for (std::size_t k = 0; k < layers.size(); ++k) {
        const std::vector<double> stated = numbers(layers[k][side]);
        for (std::size_t i = 0; i < stated.size(); ++i) {
          std::vector<double> moved = stated;
          moved[i] = std::nextafter(moved[i], goal);
          expect_refusal({"networks", name, std::to_string(k), side}, joined(moved));
        }
      }
    }
    for (std::size_t i = 0; i < values[side].size(); ++i) {
      Json moved = values[side];
      moved[i] = files::hex_float(std::nextafter(files::parse_hex_float(moved[i].get<std::string>()), goal));
      expect_refusal({side}, moved);
    }
  }
  EXPECT_EQ(tried, 2 * (6 + 4 + 5 + 2 + 2));
  Json changed = made().certificate;
  move(changed["values"][0], "jump", 0);
  EXPECT_NE(reason(changed).find("claims less than the jump"), std::string::npos);
}

TEST(BoxCertificate, IsRefusedForALargerBoxOrNone) {
  Json changed = made().certificate;
  for (std::string word : {"lower", "upper"})
    for (Json& end : changed["box"]["phi:default"][word])
      end = files::hex_float(8 * files::parse_hex_float(end.get<std::string>()));
  EXPECT_NE(reason(changed).find("does not show"), std::string::npos) << reason(changed);
  for (std::size_t i = 0; i < made().certificate["bounds"].size(); ++i) {
    if (made().certificate["bounds"][i]["upper_method"] != "local_sdp") continue;
    changed = made().certificate;
    changed["bounds"][i]["domain"] = "global";
    EXPECT_NE(reason(changed).find("of a bound without one"), std::string::npos) << reason(changed);
    changed = made().certificate;
    changed["bounds"][i]["upper_method"] = "sdp";
    EXPECT_NE(reason(changed).find("does not show"), std::string::npos) << reason(changed);
    changed = made().certificate;
    changed["bounds"][i]["upper_method"] = "branch";
    EXPECT_NE(reason(changed).find("by parts of a box"), std::string::npos) << reason(changed);
  }
  changed = made().certificate;
  for (Json& law : changed["laws"]) law["domain"] = "global";
  EXPECT_NE(reason(changed).find("holds on a box only"), std::string::npos) << reason(changed);
}

TEST(BoxCertificate, SaysNothingOfFloat32) {
  Json changed = made().certificate;
  changed["values"][0]["input_error"] = {{"phi:default", {"0x0p+0", "0x0p+0", "0x0p+0"}}};
  EXPECT_NE(reason(changed).find("float32"), std::string::npos) << reason(changed);
}

/// What is proved for one order of the activations is refused for another: each layer is judged by its own.
TEST(BoxCertificate, IsRefusedWithTheActivationsInAnotherOrder) {
  std::mt19937 generator(94);
  Network network = tests::plain(tests::random_network({3, 8, 8, 2}, generator));
  network.plain->set_activations({Activation::kTanh, Activation::kSilu});
  const Domain domain = {{"network", cube(3, 0.3)}};
  Certification found = certify(network, on_box(domain));
  found.values = certified_values(network, domain, {}, {1, false, false, 0});
  const Json made = lipschitz::certificate(network, found);
  EXPECT_TRUE(check::check(made, network).accepted);
  Network other = network;
  other.plain->set_activations({Activation::kSilu, Activation::kTanh});
  const auto refusal = [&](Json changed) {
    Json& steps = changed["network"]["weights"]["network"]["chain"];
    std::swap(steps[1]["op"], steps[3]["op"]);
    changed["content_sha256"] = files::content_sha256(changed);
    return check::check(changed, other).reason;
  };
  EXPECT_NE(refusal(made).find("does not show"), std::string::npos) << refusal(made);
  Json values = made;  // with the bounds of the other network, so that the values decide
  values["bounds"] = lipschitz::certificate(other, certify(other, on_box(domain)))["bounds"];
  EXPECT_NE(refusal(values).find("the values leave the bounds"), std::string::npos) << refusal(values);
}

/// A network of rotation invariants has no box, not even of its parts.
TEST(BoxCertificate, IsRefusedOfRotationInvariants) {
  std::mt19937 generator(95);
  Network network = tests::deep_set(with(tests::random_network({5, 6, 4}, generator), Activation::kTanh),
                                    with(tests::random_network({4, 5, 1}, generator), Activation::kTanh));
  const Domain domain = {{"phi:default", cube(5, 0.2)}};
  Json made = lipschitz::certificate(network, certify(network, on_box(domain)));
  EXPECT_TRUE(check::check(made, network).accepted);
  network.invariants = true;
  network.input_order = files::relative_state();
  made["statement"] = check::statement_for(network);
  for (const char* const method : {"local_sdp", "local_product"}) {
    Json changed = made;
    Json bound;
    for (const Json& one : made["bounds"])
      if (one["function"] == "phi:default") bound = one;
    bound["upper_method"] = method;
    bound["unit"] = files::unit(network, "phi:default", "all");
    if (std::string(method) == "local_product") bound["proof"] = nullptr;
    changed["bounds"] = Json::array({bound});
    changed["content_sha256"] = files::content_sha256(changed);
    const std::string said = check::check(changed, network).reason;
    EXPECT_NE(said.find("of a network of rotation invariants"), std::string::npos) << said;
  }
  EXPECT_THROW(check::chain_on_box(network, "phi:default", "all", {}, intervals(domain.at("phi:default"))),
               std::domain_error);
  EXPECT_THROW(certify(network, on_box(domain)), std::invalid_argument);
}

TEST(BoxCertificate, HoldsForAnIntervalOfOnePoint) {
  std::mt19937 generator(88);
  const Network network = tests::plain(with(tests::random_network({2, 6, 1}, generator), Activation::kSilu));
  const Box point = {{0.25, -1.5}, {0.25, -1.5}};
  const Certification found = certify(network, on_box({{"network", point}}));
  Json written = lipschitz::certificate(network, found);
  EXPECT_TRUE(check::check(written, network).accepted) << check::check(written, network).reason;
  EXPECT_EQ(bound_of(found, "network").method, UpperMethod::kLocalSdp);
}

}  // namespace
}  // namespace swarmcert
