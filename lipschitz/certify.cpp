#include "lipschitz/certify.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>

#include "lipschitz/base/rounding.h"
#include "lipschitz/base/stop.h"
#include "lipschitz/base/work_progress.h"
#include "lipschitz/certify_bounds.h"
#include "nn/base/parallel.h"
#include "nn/weights/functions.h"

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

/// Requires that branch and bound without a box is about ReLU networks.
/// @throws std::invalid_argument otherwise.
void require_what_is_bounded(const files::Parts& parts, const CertifyOptions& options) {
  if (options.method != UpperMethod::kBranch || !options.domain.empty()) return;
  for (const auto& [part, weights] : parts) {
    if (weights->is_relu()) continue;
    throw std::invalid_argument("--method branch without a box: for ReLU networks only; " + part.name() +
                                " has " + weights->activation_names() + " between its layers");
  }
}

/// Appends the largest activation slopes of `weights` that differ from 1.
void add_steepest_slopes(const Weights& weights, std::vector<UpperBound>& factors) {
  for (const double steepest : weights.steepest_slopes())
    if (steepest != 1) factors.emplace_back(steepest);
}

/// Sets the law's bound from the bounds of its terms, and whether one of them was interrupted.
void settle(const Network& network, const std::vector<CertifiedBound>& bounds, CertifiedLaw& law) {
  Neighbours neighbours = law.neighbours;
  if (network.phi.count(files::kGroundKind) == 1) neighbours[files::kGroundKind] = 1;
  std::vector<std::pair<UpperBound, int>> terms;
  for (const auto& [kind, count] : neighbours) {
    const CertifiedBound* best = nullptr;
    for (const CertifiedBound& bound : bounds) {
      const bool holds = bound.function == files::FunctionId::set(kind, law.rho) &&
                         bound.block == law.block && bound.scale.empty() &&
                         (bound.neighbours.empty() || bound.neighbours == law.neighbours);
      if (holds && (best == nullptr || bound.upper.value() < best->upper.value())) best = &bound;
    }
    if (best == nullptr) continue;
    terms.emplace_back(best->upper, count);
    law.interrupted = law.interrupted || best->is_interrupted();
  }
  if (terms.size() != neighbours.size())
    throw std::logic_error("certify: a law lacks the bound of one of its terms");
  law.upper = law_bound(law.law, terms);
}

}  // namespace

std::vector<Verdict> respects_gamma(const GammaStatement& gamma, const std::vector<Enclosure>& norms) {
  const double slack = gamma.mode == GammaStatement::Mode::kEqual ? kEqualTolerance : 0;
  const check::Dyadic ceiling = check::Dyadic(gamma.value) * (1 + slack);
  const check::Dyadic floor = slack > 0 ? check::Dyadic(gamma.value) * (1 - slack) : check::Dyadic();
  const auto verdict = [&](const check::Dyadic& least, const check::Dyadic& most) {
    if (ceiling >= most && least >= floor) return Verdict::kProved;
    return ceiling >= least && most >= floor ? Verdict::kInconclusive : Verdict::kRefuted;
  };
  const bool whole = gamma.scope == GammaStatement::Scope::kNetwork;
  std::vector<Verdict> result;
  check::Dyadic least(1.0), most(1.0);
  for (const Enclosure& norm : norms) {
    const std::size_t exponent = whole ? norms.size() : 1;
    result.push_back(verdict(power(norm.lower.value(), exponent), power(norm.upper.value(), exponent)));
    least = least * check::Dyadic(norm.lower.value());
    most = most * check::Dyadic(norm.upper.value());
  }
  if (whole && gamma.mode == GammaStatement::Mode::kClip) result.assign(norms.size(), verdict(least, most));
  return result;
}

bool is_interrupted(const Certification& certification) {
  return std::any_of(certification.bounds.begin(), certification.bounds.end(),
                     [](const CertifiedBound& bound) { return bound.is_interrupted(); });
}

const char* status(bool is_interrupted) { return is_interrupted ? "interrupted" : "finished"; }

const char* name(UpperMethod method) {
  switch (method) {
    case UpperMethod::kAuto:
      return "auto";
    case UpperMethod::kProduct:
      return "product";
    case UpperMethod::kEclipseFast:
      return "eclipse_fast";
    case UpperMethod::kSdp:
      return "sdp";
    case UpperMethod::kLocalProduct:
      return "local_product";
    case UpperMethod::kLocalSdp:
      return "local_sdp";
    case UpperMethod::kBranch:
      break;
  }
  return "branch";
}

namespace {

/// Adds the claims requested by the options, without bounds.
void add_claims(const Network& network, const CertifyOptions& options, Certification& result) {
  ClaimOptions wanted = options;
  wanted.counted = options.method == UpperMethod::kBranch;
  for (Claim& claim : claims(network, wanted)) {
    result.bounds.emplace_back();
    static_cast<Claim&>(result.bounds.back()) = std::move(claim);
  }
  for (LawClaim& claim : law_claims(network, options)) {
    result.laws.emplace_back();
    static_cast<LawClaim&>(result.laws.back()) = std::move(claim);
  }
}

void enclose_norms(const std::vector<const files::Layer*>& layers, int jobs, WorkProgress& progress,
                   const std::optional<GammaStatement>& gamma, std::vector<CertifiedLayer>& certified) {
  std::optional<double> limit;
  if (gamma && gamma->scope == GammaStatement::Scope::kLayer) limit = gamma->value;
  files::parallel_for(static_cast<int>(layers.size()), jobs, [&](int i) {
    CertifiedLayer& layer = certified[static_cast<std::size_t>(i)];
    progress.run("spectral norm of " + layer.network.name() + " " + layer.name,
                 [&] { layer.norm = spectral_norm(*layers[static_cast<std::size_t>(i)], limit); });
  });
}

void judge_gamma(const files::Parts& parts, Certification& result) {
  if (!result.gamma) return;
  std::size_t next = 0, next_stored = 0;
  for (const auto& [name, weights] : parts) {
    std::vector<Enclosure> norms;
    std::vector<CertifiedLayer*> judged;
    const bool is_rewritten = !weights->stored.empty();
    if (is_rewritten) next += weights->layers.size();
    for (const files::Layer& layer : weights->stored_layers()) {
      CertifiedLayer& certified = is_rewritten ? result.stored[next_stored++] : result.layers[next++];
      if (layer.is_added) continue;
      norms.push_back(certified.norm.norm);
      judged.push_back(&certified);
    }
    const auto verdicts = respects_gamma(*result.gamma, norms);
    for (std::size_t k = 0; k < norms.size(); ++k) judged[k]->respects_gamma = verdicts[k];
  }
}

/// Sets the first upper bound: the product of the norms, the scale and the steepest activation slopes.
void multiply_norms(const Network& network, const files::Parts& parts,
                    const std::vector<CertifiedLayer>& layers, CertifiedBound& bound) {
  std::vector<UpperBound> norms;
  if (!bound.scale.empty()) norms.emplace_back(*std::max_element(bound.scale.begin(), bound.scale.end()));
  for (const files::FunctionId& name : bound.function.parts()) {
    for (const CertifiedLayer& layer : layers) {
      if (layer.network == name) norms.push_back(layer.norm.norm.upper);
    }
    add_steepest_slopes(*parts.at(name), norms);
    for (const files::Activation activation : parts.at(name)->activations()) {
      const files::ActivationFunction& function = files::function_of(activation);
      bound.has_slopes = bound.has_slopes && !function.sorts();
      bound.is_monotone = bound.is_monotone && function.is_monotone() && !function.sorts();
    }
    bound.has_local_slopes = bound.has_local_slopes || (bound.domain == "box" && !parts.at(name)->is_relu());
  }
  bound.is_relu = has_relu_only(network, bound.function);
  bound.product = bound.upper = product_up(norms);
}

}  // namespace

std::vector<CertifiedLayer> stated_norms(const Network& network, const Certification& certification) {
  std::vector<CertifiedLayer> result;
  for (const auto& [part, weights] : files::parts(network))
    for (const CertifiedLayer& layer : weights->stored.empty() ? certification.layers : certification.stored)
      if (layer.network == part) result.push_back(layer);
  return result;
}

Certification certify(const Network& network, const CertifyOptions& options) {
  const Stop stop(options.cancelled, options.seconds);
  Certification result;
  result.gamma = options.gamma ? options.gamma : network.gamma;
  if (result.gamma && !(result.gamma->value > 0))
    throw std::invalid_argument("certify: gamma must be positive");
  require_moderate(network);
  const files::Parts parts = files::parts(network);
  require_what_is_bounded(parts, options);
  std::vector<const files::Layer*> layers, stored;
  for (const auto& [name, weights] : parts) {
    for (const files::Layer& layer : weights->layers) {
      layers.push_back(&layer);
      result.layers.push_back({name, layer.name, {}, std::nullopt});
    }
    for (const files::Layer& layer : weights->stored) {
      stored.push_back(&layer);
      result.stored.push_back({name, layer.name, {}, std::nullopt});
    }
  }
  result.domain = options.domain;
  add_claims(network, options, result);

  WorkProgress progress(static_cast<int>(layers.size() + stored.size()) +
                            pieces_of_work(options, static_cast<int>(result.bounds.size())),
                        options.progress);
  enclose_norms(layers, options.jobs, progress, result.gamma, result.layers);
  enclose_norms(stored, options.jobs, progress, result.gamma, result.stored);
  judge_gamma(parts, result);
  for (CertifiedBound& bound : result.bounds) multiply_norms(network, parts, result.layers, bound);
  find_bounds(network, options, stop, progress, result.layers, result.bounds);
  for (CertifiedLaw& law : result.laws) {
    settle(network, result.bounds, law);
    for (const CertifiedBound& bound : result.bounds)
      if (is_local(bound.method) && bound.domain == "box") law.domain = "box";
  }
  return result;
}

UpperBound law_bound(LawKind law, const std::vector<std::pair<UpperBound, int>>& terms) {
  check::Dyadic sum, sum_of_squares;
  for (const auto& [bound, count] : terms) {
    if (!std::isfinite(bound.value())) return bound;
    const check::Dyadic n = static_cast<double>(count), k = bound.value();
    sum += n * k;
    sum_of_squares += n * k * k;
  }
  return UpperBound(law == LawKind::kAllStacked ? sqrt_up(sum_of_squares) : rounded_up(sum));
}

}  // namespace swarmcert::lipschitz
