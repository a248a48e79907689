#include <fmt/core.h>

#include "analysis/gate/checks/checks.h"
#include "analysis/gate/evidence.h"
#include "lipschitz/certify.h"
#include "lipschitz/upper/spectral_norm.h"
#include "nn/base/file_keys.h"
#include "nn/base/toml.h"
#include "nn/weights/functions.h"

namespace swarmcert::gate {
namespace {

using files::GammaStatement;
using lipschitz::Enclosure;

void judge_norms(Evidence& evidence, const std::optional<Limit>& own, int line, Checks& checks) {
  const files::Network& network = evidence.flown();
  std::optional<GammaStatement> gamma = network.gamma;
  if (own) gamma = GammaStatement{own->value};
  Check check = row("spectral_norms", line);
  if (own) check.line = own->line;
  if (!gamma) {
    fail(check, "network.toml declares no gamma: declare it, or state max in [spectral_norms]");
    checks.push_back(std::move(check));
    return;
  }
  check.limit = gamma->value;
  lipschitz::require_moderate(network);
  pass(check);
  double largest = 0;
  for (const auto& [part, weights] : files::parts(network)) {
    std::vector<Enclosure> norms;
    for (const files::Layer& layer : weights->stored_layers())
      norms.push_back(lipschitz::spectral_norm(layer, gamma->value).norm);
    const std::vector<lipschitz::Verdict> verdicts = lipschitz::respects_gamma(*gamma, norms);
    const bool of_network = gamma->scope == GammaStatement::Scope::kNetwork;
    if (of_network) {
      std::vector<lipschitz::UpperBound> factors;
      for (const Enclosure& norm : norms) factors.push_back(norm.upper);
      largest = std::max(largest, lipschitz::product_up(factors).value());
    }
    for (std::size_t k = 0; k < norms.size(); ++k) {
      if (!of_network) largest = std::max(largest, norms[k].upper.value());
      if (verdicts[k] == lipschitz::Verdict::kProved || check.verdict == Verdict::kFail) continue;
      const bool is_refuted = verdicts[k] == lipschitz::Verdict::kRefuted;
      check.verdict = is_refuted ? Verdict::kFail : Verdict::kInconclusive;
      check.reason = fmt::format("{} {} {} gamma {}", part.name(), weights->stored_layers()[k].name,
                                 is_refuted ? "breaks" : "is too near to", gamma->value);
      check.witness = fmt::format("{} {}: {:.15g} .. {:.15g}", part.name(), weights->stored_layers()[k].name,
                                  norms[k].lower.value(), norms[k].upper.value());
    }
  }
  check.value = largest;
  checks.push_back(std::move(check));
}

}  // namespace

void describe_spectral_norms_keys(files::Keys& keys) {
  keys.may<double>("max", "Of every layer; absent: the declared gamma.");
}

Run read_spectral_norms(const files::TomlTable& table, Policy&) {
  const std::optional<Limit> own = limit(table, "max", "");
  if (own && !(own->value > 0)) table.refuse("max", fmt::format("{}", own->value), "must be positive");
  return [own, line = table.line()](Evidence& evidence, Checks& checks) {
    judge_norms(evidence, own, line, checks);
  };
}

}  // namespace swarmcert::gate
