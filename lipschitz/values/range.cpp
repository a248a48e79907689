#include "lipschitz/values/range.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "lipschitz/values/attained_values.h"
#include "lipschitz/values/function_range.h"
#include "lipschitz/values/value_bounds.h"
#include "nn/base/doubles.h"
#include "nn/base/parallel.h"
#include "nn/weights/compositions.h"
#include "nn/weights/functions.h"

namespace swarmcert::lipschitz {
namespace {

using files::Network;

constexpr int kUsualRangeNodes = 16000;

/// The ends of one output among some neighbours; the function is 0 throughout where it is silent.
struct Ends {
  double lower = 0, upper = 0;
  bool is_silent = false;
  double largest() const { return std::max(-lower, upper); }
};

/// Bounds of all outputs of one function, for 1, 2, ... neighbours.
class RangesOf {
 public:
  /// @param domain where the inputs are, after the clamp.
  RangesOf(const Network& network, const Domain& domain, files::FunctionId function,
           const std::map<std::string, double>& rho_bound, const RangeOptions& options,
           std::function<void()> searched)
      : network_(network),
        function_(std::move(function)),
        names_(function_.parts()),
        is_set_(names_.size() == 2),
        only_kind_(network.phi.size() == 1 + network.phi.count(files::kGroundKind)),
        neighbours_(options.neighbours),
        searched_(std::move(searched)),
        values_(network, domain, function_,
                options.nodes > 0 ? options.nodes : usual_nodes(network, function_, kUsualRangeNodes),
                options.jobs) {
    if (!is_set_) return;
    jump_at_any_sum_ = up(values_.jump_norm() * rho_bound.at(names_[1].kind()));
    // Of one kind, all steps are seen one after the other.
    if (!only_kind_) beside_silent_ = steps_of(network, function_);
  }

  std::vector<CertifiedRange> all() {
    std::vector<CertifiedRange> found;
    for (int output = 0; output < values_.outputs(); ++output) add(output, found);
    return found;
  }

  /// Compositions in which values are bounded beside those of the function's own kind, for the jump.
  static std::vector<Composition> steps_of(const Network& network, const files::FunctionId& function) {
    std::vector<Composition> result;
    for (const std::vector<files::FunctionId>& parts : files::beside_silent(network, function)) {
      result.emplace_back();
      for (const files::FunctionId& part : parts) ++result.back()[part];
    }
    return result;
  }

 private:
  Ends ends(int output, const Composition& neighbours, Candidates& low, Candidates& high) {
    Ends found;
    found.is_silent = is_set_ && values_.is_silent(neighbours);
    found.upper = values_.largest(output, 1, neighbours, high);
    searched_();
    found.lower = 0 - values_.largest(output, -1, neighbours, low);  // 0, not -0, where it is silent
    searched_();
    return found;
  }

  /// |f - f'| where the second of two numbers of neighbours follows on the first.
  double step(const Ends& before, const Ends& after) const {
    if (before.is_silent && after.is_silent) return 0;
    const double between = std::max({0.0, up(after.upper - before.lower), up(before.upper - after.lower)});
    return before.is_silent || after.is_silent ? between : std::min(between, jump_at_any_sum_);
  }

  void add(int output, std::vector<CertifiedRange>& found) {
    Candidates high, low, unused;
    CertifiedRange range;
    range.function = function_;
    range.output = output;
    range.upper = -kInfinity;
    range.lower = kInfinity;
    if (is_set_ && !only_kind_) range.jump = jump_at_any_sum_;
    for (const Composition& beside : beside_silent_)
      range.jump = std::max(range.jump, ends(output, beside, unused, unused).largest());
    Ends before;
    for (int n = is_set_ ? 0 : 1; n <= (is_set_ ? neighbours_ : 1); ++n) {
      const Ends now = ends(output, is_set_ ? Composition{{names_[0], n}} : Composition(), low, high);
      range.upper = std::max(range.upper, now.upper);
      range.lower = std::min(range.lower, now.lower);
      if (n > 0 && only_kind_ && is_set_) range.jump = std::max(range.jump, step(before, now));
      before = now;
      if (is_set_ && n == 0) continue;
      range.neighbours_at_most = is_set_ ? n : 0;
      range.greatest = values_.attained(output, 1, high);
      range.least = values_.attained(output, -1, low);
      found.push_back(range);
    }
  }

  const Network& network_;
  files::FunctionId function_;
  std::vector<files::FunctionId> names_;
  bool is_set_, only_kind_;
  int neighbours_;
  std::function<void()> searched_;
  FunctionRange values_;
  double jump_at_any_sum_ = 0;
  std::vector<Composition> beside_silent_;
};

/// Whether branch and bound on values can follow `function`, and with it the ground's term, and those of neighbours
/// beside which the network is silent.
bool is_of_relu(const Network& network, const files::FunctionId& function) {
  const auto is_relu = [&network](const std::string& kind) {
    const auto phi = network.phi.find(kind);
    return phi == network.phi.end() || phi->second.is_relu();
  };
  for (const std::vector<files::FunctionId>& parts : files::beside_silent(network, function))
    for (const files::FunctionId& part : parts)
      if (!is_relu(part.kind())) return false;
  return files::is_relu(network, function) && is_relu(files::kGroundKind);
}

/// What a certificate states of a function with other activations, and values that it takes.
std::vector<CertifiedRange> stated_ranges(const Network& network, const Domain& domain,
                                          const files::FunctionId& function,
                                          const std::map<std::string, double>& rho_bound,
                                          const RangeOptions& options) {
  std::vector<CertifiedRange> result;
  for (const CertifiedValues& values :
       certified_values(network, domain, rho_bound, {options.neighbours, false, false, 0}, function)) {
    const std::vector<AttainedEnds> ends =
        attained_ends(network, domain, function, std::max(1, values.neighbours));
    for (std::size_t i = 0; i < ends.size(); ++i) {
      CertifiedRange range;
      range.function = function;
      range.output = static_cast<int>(i);
      range.neighbours_at_most = values.neighbours;
      range.lower = values.lower[i];
      range.upper = values.upper[i];
      range.least = ends[i].least;
      range.greatest = ends[i].greatest;
      range.jump = values.jump.value_or(0);
      result.push_back(std::move(range));
    }
  }
  return result;
}

}  // namespace

Domain clamped(const Network& network, const Domain& domain) {
  Domain result = domain;
  if (!network.clamp) return result;
  for (auto& [part, box] : result) {
    if (!files::is_clamped(part)) continue;
    for (std::size_t k = 0; k < box.lower.size(); ++k) {
      box.lower[k] = std::clamp(box.lower[k], network.clamp->lower[k], network.clamp->upper[k]);
      box.upper[k] = std::clamp(box.upper[k], network.clamp->lower[k], network.clamp->upper[k]);
    }
  }
  return result;
}

Domain clamp_domain(const Network& network) {
  Domain result;
  if (!network.clamp || network.phi.count(files::kGroundKind) == 1) return result;
  for (const auto& [kind, phi] : network.phi)
    result[files::FunctionId::phi(kind)] = {network.clamp->lower, network.clamp->upper};
  if (network.plain) result["network"] = {network.clamp->lower, network.clamp->upper};
  return result;
}

int usual_nodes(const Network& network, const files::FunctionId& function, int most) {
  constexpr double kFewest = 600, kWeights = 8000;
  double weights = 0;
  const auto parts = files::parts(network);
  for (const files::FunctionId& name : function.parts())
    for (const files::Layer& layer : parts.at(name)->layers) weights += layer.inputs * layer.outputs;
  return static_cast<int>(std::clamp(most * std::pow(kWeights / weights, 2), kFewest, 1.0 * most));
}

std::vector<files::FunctionId> value_functions(const Network& network) {
  std::vector<files::FunctionId> functions;
  for (const files::FunctionId& function : files::functions(network)) {
    const bool is_set = function.is_set();
    if (function.is_plain() || (is_set && !function.input_part().is_ground_phi()))
      functions.push_back(function);
  }
  return functions;
}

std::vector<CertifiedRange> ranges(const Network& network, const Domain& domain,
                                   const std::map<std::string, double>& rho_bound,
                                   const RangeOptions& options) {
  const Domain inner = clamped(network, domain);
  // One function after the other: each search uses all threads.
  std::vector<CertifiedRange> result;
  int done = 0, total = 0;
  const std::vector<files::FunctionId> functions = value_functions(network);
  for (const files::FunctionId& function : functions) {
    if (!is_of_relu(network, function)) continue;
    const int outputs = files::parts(network).at(function.output_part())->outputs();
    const int steps = static_cast<int>(RangesOf::steps_of(network, function).size());
    total += outputs * (function.is_set() ? 2 * (1 + options.neighbours + steps) : 2);
  }
  const auto searched = [&] {
    if (options.progress) options.progress(++done, total);
  };
  for (const files::FunctionId& function : functions) {
    const std::vector<CertifiedRange> found =
        is_of_relu(network, function) ? RangesOf(network, inner, function, rho_bound, options, searched).all()
                                      : stated_ranges(network, inner, function, rho_bound, options);
    result.insert(result.end(), found.begin(), found.end());
  }
  return result;
}

}  // namespace swarmcert::lipschitz
