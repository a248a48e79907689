#include "lipschitz/certify.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <stdexcept>

#include "lipschitz/checker/check.h"
#include "nn/files/functions.h"
#include "nn/files/parallel.h"

namespace swarmcert::lipschitz {
namespace {

using files::GammaStatement;
using files::Network;
using files::Weights;

check::Dyadic power(double base, std::size_t exponent) {
  check::Dyadic result(1.0);
  for (std::size_t i = 0; i < exponent; ++i) result = result * base;
  return result;
}

/// The function whose slope is searched, with `neighbours` neighbours in all, and the networks of the fixed ones.
struct SearchTarget {
  SlopeFunction function;
  std::vector<std::string> other_networks;
};

SearchTarget search_target(const Network& network, const std::string& function, int neighbours) {
  const std::map<std::string, const Weights*> parts = files::parts(network);
  const std::vector<std::string> names = files::networks_of(function);
  const auto term = [&](const std::string& name) {
    return Term{parts.at(name), network.clamp && files::is_clamped(name) ? &*network.clamp : nullptr};
  };
  SearchTarget target;
  target.function.moved = term(names[0]);
  if (names.size() == 1) return target;
  target.function.rho = parts.at(names[1]);
  const std::string ground = std::string("phi:") + files::kGroundKind;
  if (names[0] != ground && parts.count(ground) == 1) target.other_networks.push_back(ground);
  const bool ground_moves = names[0] == ground;
  std::vector<std::string> kinds;  // the moving neighbour's own kind first
  if (!ground_moves) kinds.push_back(names[0]);
  for (const auto& [name, weights] : parts) {
    if (name.rfind("phi:", 0) == 0 && name != ground && name != names[0]) kinds.push_back(name);
  }
  for (int j = ground_moves ? 0 : 1; j < neighbours && !kinds.empty(); ++j) {
    target.other_networks.push_back(kinds[static_cast<std::size_t>(j) % kinds.size()]);
  }
  for (const std::string& name : target.other_networks) target.function.others.push_back(term(name));
  return target;
}

/// Numbers of neighbours at which a set function is searched: more rarely steepen it further.
constexpr int kMostNeighbours = 3;

/// Rounds that keep the search of a function to seconds: a region costs about (weights) x (moving inputs).
int default_rounds(const Network& network, const std::string& function) {
  const std::map<std::string, const Weights*> parts = files::parts(network);
  const std::vector<std::string> names = files::networks_of(function);
  double weights = 0;
  for (const std::string& name : names) {
    for (const files::Layer& layer : parts.at(name)->layers)
      weights += static_cast<double>(layer.weights.size());
  }
  constexpr double kPapersCost = 4.3e3 * 40;  // rho 40-40-40-40-1
  const double cost = weights * parts.at(names[0])->inputs();
  return static_cast<int>(
      std::clamp(kDefaultSearchRounds * kPapersCost / cost, 2.0, 1.0 * kDefaultSearchRounds));
}

void search_lower(const Network& network, const CertifyOptions& options, std::uint64_t seed,
                  CertifiedBound& bound) {
  const bool is_set = files::networks_of(bound.function).size() == 2;
  const int rounds = options.search_rounds.value_or(default_rounds(network, bound.function));
  if (rounds == 0) return;
  const int cases = is_set ? kMostNeighbours : 1;  // they share the rounds and the seconds
  for (int neighbours = 1; neighbours <= cases; ++neighbours) {
    SearchTarget target = search_target(network, bound.function, neighbours);
    SlopeSearchOptions search;
    search.seed = seed + static_cast<std::uint64_t>(neighbours) * 1000003;
    search.rounds = (rounds + cases - 1) / cases;
    search.seconds = options.search_seconds / cases;
    search.cancelled = options.cancelled;
    SlopeWitness found = search_slope(target.function, search);
    bound.search_rounds += found.rounds_done;
    if (!bound.witness || found.slope.value() > bound.witness->slope.value()) {
      bound.witness = std::move(found);
      bound.other_networks = std::move(target.other_networks);
    }
  }
}

}  // namespace

Verdict respects_gamma(const GammaStatement& gamma, const Enclosure& norm, std::size_t layers) {
  const std::size_t exponent = gamma.scope == GammaStatement::Scope::kLayer ? 1 : layers;
  const double slack = gamma.mode == GammaStatement::Mode::kEqual ? kEqualTolerance : 0;
  const check::Dyadic least = power(norm.lower.value(), exponent);
  const check::Dyadic most = power(norm.upper.value(), exponent);
  const check::Dyadic ceiling = check::Dyadic(gamma.value) * (1 + slack);
  const check::Dyadic floor = slack > 0 ? check::Dyadic(gamma.value) * (1 - slack) : check::Dyadic();
  if (ceiling >= most && least >= floor) return Verdict::kProved;
  return ceiling >= least && most >= floor ? Verdict::kInconclusive : Verdict::kRefuted;
}

const char* name(UpperMethod method) {
  return method == UpperMethod::kAuto ? "auto" : method == UpperMethod::kProduct ? "product" : "sdp";
}

Certification certify(const Network& network, const CertifyOptions& options) {
  Certification result;
  result.gamma = options.gamma ? options.gamma : network.gamma;
  if (result.gamma && !(result.gamma->value > 0)) {
    throw std::invalid_argument("certify: gamma must be positive");
  }
  const std::map<std::string, const Weights*> parts = files::parts(network);
  std::vector<const files::Layer*> layers;
  for (const auto& [name, weights] : parts) {
    for (const files::Layer& layer : weights->layers) {
      layers.push_back(&layer);
      result.layers.push_back({name, layer.name, {}, std::nullopt});
    }
  }
  for (const std::string& function : files::functions(network)) {
    result.bounds.emplace_back();
    result.bounds.back().function = function;
  }

  const int total = static_cast<int>(layers.size() + 2 * result.bounds.size());
  int done = 0;
  std::mutex mutex;
  const auto report = [&](const std::string& what) {
    const std::lock_guard<std::mutex> lock(mutex);
    ++done;
    if (options.progress) options.progress(done, total, what);
  };

  files::parallel_for(static_cast<int>(layers.size()), options.jobs, [&](int i) {
    CertifiedLayer& layer = result.layers[static_cast<std::size_t>(i)];
    const std::size_t depth = parts.at(layer.network)->layers.size();
    std::optional<double> limit;
    if (result.gamma && result.gamma->scope == GammaStatement::Scope::kLayer) limit = result.gamma->value;
    layer.norm = spectral_norm(*layers[static_cast<std::size_t>(i)], limit);
    if (result.gamma) layer.respects_gamma = respects_gamma(*result.gamma, layer.norm.norm, depth);
    report("spectral norm of " + layer.network + " " + layer.name);
  });

  for (CertifiedBound& bound : result.bounds) {
    std::vector<UpperBound> norms;
    for (const std::string& name : files::networks_of(bound.function)) {
      for (const CertifiedLayer& layer : result.layers) {
        if (layer.network == name) norms.push_back(layer.norm.norm.upper);
      }
    }
    bound.product = bound.upper = product_up(norms);
  }

  // Upper bounds and searches are one flat list of independent pieces.
  const int count = static_cast<int>(result.bounds.size());
  files::parallel_for(2 * count, options.jobs, [&](int i) {
    CertifiedBound& bound = result.bounds[static_cast<std::size_t>(i % count)];
    if (i < count) {
      if (options.method != UpperMethod::kProduct) {
        bound.sdp = sdp_bound(check::stages(network, bound.function), options.cancelled);
        const bool smaller = bound.sdp.proof && bound.sdp.proof->upper.value() < bound.product.value();
        if (bound.sdp.proof && (smaller || options.method == UpperMethod::kSdp)) {
          bound.upper = bound.sdp.proof->upper;
          bound.method = UpperMethod::kSdp;
          bound.proof = std::move(bound.sdp.proof);
          bound.sdp.proof.reset();
        }
      }
      report("upper bound of " + bound.function);
    } else {
      search_lower(network, options, options.seed, bound);
      report("lower bound of " + bound.function);
    }
  });
  return result;
}

}  // namespace swarmcert::lipschitz
