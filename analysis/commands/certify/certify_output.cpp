#include "analysis/commands/certify/certify_output.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "analysis/cli/command.h"
#include "analysis/cli/counted.h"
#include "analysis/commands/certify/branch_outlook.h"
#include "nn/weights/chain.h"
#include "nn/weights/compositions.h"
#include "nn/weights/functions.h"

namespace swarmcert::analysis {
namespace {

using lipschitz::Certification;
using lipschitz::CertifiedBound;
using lipschitz::CertifiedLayer;
using lipschitz::Verdict;

std::string group_label(const lipschitz::Neighbours& neighbours) {
  std::string text;
  for (const auto& [kind, count] : neighbours)
    text += fmt::format("{}{} {}", text.empty() ? "" : " + ", count, kind);
  return text;
}

}  // namespace

std::string output_unit(const files::Network& network) {
  return network.output_unit.empty() ? "output" : network.output_unit;
}

double slope_found(const CertifiedBound& bound) {
  return bound.lower.witness ? bound.lower.witness->slope.value() : 0;
}

const lipschitz::CertifiedValues* in_certificate(const CertifyOutput& output,
                                                 const files::FunctionId& function, int neighbours) {
  for (const lipschitz::CertifiedValues& values : output.found.values)
    if (values.function == function && values.neighbours == neighbours) return &values;
  return nullptr;
}

std::string label(const CertifiedBound& bound) {
  return bound.function.name() + (bound.block == "all" ? "" : " " + bound.block) +
         (bound.scale.empty() ? "" : " scaled") +
         (bound.neighbours.empty() ? "" : ", at most " + group_label(bound.neighbours));
}

std::vector<std::string> explain(const lipschitz::Comparison& comparison, double product, double upper,
                                 double lower) {
  std::vector<std::string> words;
  const double floor = comparison.floor.slope.value();
  words.push_back(
      fmt::format("The product of norms is {:.3g} times the proved bound: it assumes the steepest direction "
                  "in every layer and every ReLU active.",
                  product / upper));
  const lipschitz::StageLoss* worst = nullptr;
  for (const lipschitz::StageLoss& stage : comparison.stages)
    if (worst == nullptr || stage.loss() > worst->loss()) worst = &stage;
  if (worst != nullptr && worst->gain > 0)
    words.push_back(
        fmt::format("{} has the largest slack: its norm is {:.4g}, but along the steepest pattern it "
                    "amplifies by {:.4g} (a factor {:.3g}). Regularising it further costs the least.",
                    worst->name, worst->norm, worst->gain, worst->loss()));
  double open = 1;
  std::size_t tightest = 0;
  for (std::size_t k = 0; k < comparison.floor.relu_gains.size(); ++k) {
    open *= comparison.floor.relu_gains[k];
    if (comparison.floor.relu_gains[k] < comparison.floor.relu_gains[tightest]) tightest = k;
  }
  if (!comparison.floor.relu_gains.empty() && open > 0)
    words.push_back(fmt::format("Inactive ReLUs reduce the product by a factor {:.3g}, most of it after {}.",
                                1 / open, comparison.stages[tightest].name));
  if (floor > 0)
    words.push_back(fmt::format(
        "The relaxation accounts for at most {:.2g} % of the bound: some ReLU pattern has the slope {:.8g}, "
        "and a method that ignores which patterns are reachable cannot prove a smaller bound.",
        100 * (upper / floor - 1), floor));
  if (lower > 0 && floor > lower)
    words.push_back(
        fmt::format("The remaining factor {:.4g} down to the steepest slope found is due to patterns that no "
                    "input reaches, or to slopes that the search did not find.",
                    floor / lower));
  return words;
}

namespace {

std::string sizes(const files::Weights& weights) {
  std::string text = std::to_string(weights.inputs());
  for (const files::Layer& layer : weights.layers) text += "-" + std::to_string(layer.outputs);
  return text;
}

/// The first line: what has to be known before any number is read.
void print_heading(const files::Network& network, const CertifyOutput& output) {
  const files::Parts parts = files::parts(network);
  const bool is_by_default = std::any_of(parts.begin(), parts.end(), [&output](const auto& part) {
    return !part.second->states_activation() && part.second->layers.size() > 1 &&
           output.found.samples.count(part.first) == 0;
  });
  if (!output.assumed.empty())
    fmt::print(
        "ASSUMED, so nothing is proved of the trained network: {}. State it (--order, --select) or confirm "
        "it "
        "(--samples)\n",
        fmt::join(output.assumed, "; "));
  fmt::print("Functions that are certified{}\n",
             is_by_default ? ", with ReLU between the layers where the file states nothing" : "");
}

void print_chains(const files::Network& network, const Certification& found) {
  for (const auto& [part, weights] : files::parts(network)) {
    std::string remark;
    switch (weights->order_source) {
      case files::OrderSource::kFile:
        remark = "as the file states";
        break;
      case files::OrderSource::kNames:
        remark = "order by the names of the layers";
        break;
      case files::OrderSource::kShapes:
        remark = "the only order that fits the shapes";
        break;
      case files::OrderSource::kUser:
        remark = "order as given";
        break;
    }
    const auto samples = found.samples.find(part);
    const bool is_given = weights->activation_source == files::ActivationSource::kUser;
    if (weights->activation_source != files::ActivationSource::kFile && weights->layers.size() > 1 &&
        samples == found.samples.end())
      remark +=
          is_given ? "; activation as given, --samples compares" : "; ReLU by default, --samples compares";
    fmt::print("  {}  {}  ({})\n", part.name(), files::chain_words(files::chain(network, part)), remark);
    for (const std::string& note : reading_notes(*weights)) fmt::print("    {}\n", note);
    if (samples == found.samples.end()) continue;
    const files::SampleAgreement& agreement = samples->second;
    fmt::print("    reproduces {} samples of {}: largest deviation {:.3g}, tolerance {:.3g}\n",
               agreement.count, agreement.path, agreement.largest_deviation, agreement.tolerance);
  }
  fmt::print("\n");
}

void print_layers(const files::Network& network, const Certification& found) {
  const std::vector<CertifiedLayer> norms = stated_norms(network, found);
  fmt::print("Spectral norms, enclosed from both sides in exact arithmetic\n");
  for (const auto& [part, weights] : files::parts(network)) {
    fmt::print("  {}  {}  ({}, {})\n", part.name(), weights->path, sizes(*weights),
               files::name(weights->precision));
    for (const CertifiedLayer& layer : norms) {
      if (layer.network != part) continue;
      const double lower = layer.norm.norm.lower.value();
      const double upper = layer.norm.norm.upper.value();
      std::string remark;
      if (layer.respects_gamma) {
        const double value = found.gamma->value;
        const bool per_layer = found.gamma->scope == files::GammaStatement::Scope::kLayer;
        const bool is_equal = found.gamma->mode == files::GammaStatement::Mode::kEqual;
        const std::string limit = per_layer  ? fmt::format("gamma {}", value)
                                  : is_equal ? fmt::format("its share of gamma {}", value)
                                             : fmt::format("gamma {} over all layers", value);
        remark = *layer.respects_gamma == Verdict::kProved    ? "  within " + limit
                 : *layer.respects_gamma == Verdict::kRefuted ? "  VIOLATES " + limit
                                                              : "  too close to " + limit + " to tell";
        if (per_layer && *layer.respects_gamma == Verdict::kRefuted)
          remark += fmt::format(" by {:+.3g}", lower - value);
      }
      fmt::print("    {:<8} {:.15g} .. {:.15g}{}\n", layer.name, lower, upper, remark);
    }
  }
}

/// Says which searches were cut short and how far they got, or that branch and bound could not improve further. Empty
/// if neither applies.
std::string interruption_words(const CertifiedBound& bound) {
  std::string words;
  const auto add = [&words](const std::string& what) { words += (words.empty() ? "" : "; ") + what; };
  if (bound.branch_stop == lipschitz::BranchStop::kNothingRun && is_interrupted(bound.sdp.stop))
    add(fmt::format("the semidefinite program after {} iterations ({})", bound.sdp.iterations,
                    name(bound.sdp.stop)));
  if (is_interrupted(bound.branch_stop))
    add(fmt::format("branch and bound after {} boxes ({})", bound.nodes, name(bound.branch_stop)));
  if (bound.lower.interrupted)
    add(fmt::format("the search for steep slopes after {} rounds", bound.lower.rounds));
  if (!words.empty()) return "interrupted: " + words + "; more time may give closer bounds";
  if (bound.branch_stop == lipschitz::BranchStop::kNothingToHalve)
    return fmt::format(
        "branch and bound stopped after {} boxes: bisecting the dominating box decides no further neuron{}",
        bound.nodes,
        bound.domain == "global"
            ? "; far out, kinks that run side by side to infinity meet in one point of the cover"
            : "");
  return {};
}

void print_bounds(const files::Network& network, const CertifyOutput& output) {
  const Certification& found = output.found;
  std::size_t width = 8, method_width = 7;
  for (const CertifiedBound& bound : found.bounds) {
    width = std::max(width, label(bound).size());
    method_width = std::max(method_width, std::string(name(bound.method)).size());
  }
  fmt::print("\nLipschitz constants over {}, Euclidean norms\n",
             found.domain.empty() ? "all inputs" : "the box");
  fmt::print("  {:<{}}  {:>14}  {:<{}}  {:>12}  {:>14}  {:>6}  {}\n", "function", width, "proved upper",
             "method", method_width, "product", "witnessed", "ratio", "unit");
  for (std::size_t i = 0; i < found.bounds.size(); ++i) {
    const CertifiedBound& bound = found.bounds[i];
    const double lower = slope_found(bound);
    fmt::print("  {:<{}}  {:>14.10g}  {:<{}}  {:>12.8g}  {:>14}  {:>6}  {}\n", label(bound), width,
               bound.upper.value(), name(bound.method), method_width, bound.product.value(),
               bound.lower.witness ? fmt::format("{:.8g}", lower) : "-",
               lower > 0 ? fmt::format("{:.3f}", bound.upper.value() / lower) : "-",
               files::unit(network, bound.function, bound.block));
    const bool unproved = !bound.proof && !bound.sdp.proof && !bound.local;
    if (unproved && bound.sdp.stop != lipschitz::LipSdpStop::kNothingRun && !is_interrupted(bound.sdp.stop)) {
      fmt::print("    no bound from the semidefinite program could be proved: {}\n", name(bound.sdp.stop));
    }
    const std::string interruption = interruption_words(bound);
    if (!interruption.empty()) fmt::print("    {}\n", interruption);
    const std::string outlook = branch_outlook_words(bound);
    if (!outlook.empty()) fmt::print("    {}\n", outlook);
  }
  if (found.domain.empty() && std::any_of(found.bounds.begin(), found.bounds.end(),
                                          [](const CertifiedBound& bound) { return !bound.is_relu; }))
    fmt::print("  {}\n", kForReluOnly);
  if (!network.silent.empty())
    fmt::print("  {}{}\n", kWhereSilent, fmt::join(files::silent_compositions(network), ", "));
  if (!network.rho.empty()) {
    fmt::print("  set: one neighbour moves; any number of other neighbours, anywhere\n");
    const auto is_counted = [](const CertifiedBound& bound) { return !bound.neighbours.empty(); };
    if (std::any_of(found.bounds.begin(), found.bounds.end(), is_counted))
      fmt::print("  at most: while all neighbours are in the box, and no more than these\n");
  }
  const auto is_block = [](const CertifiedBound& bound) { return bound.block == "position"; };
  if (std::any_of(found.bounds.begin(), found.bounds.end(), is_block))
    fmt::print("  blocks add up: |df| <= L_position |dp| + L_velocity |dv|\n");
}

void print_comparisons(const CertifyOutput& output) {
  for (std::size_t i = 0; i < output.comparisons.size(); ++i) {
    if (!output.comparisons[i]) continue;
    const lipschitz::Comparison& comparison = *output.comparisons[i];
    const CertifiedBound& bound = output.found.bounds[i];
    const auto shown = [](double value) {
      return value > 0 ? fmt::format("{:.10g}", value) : std::string("none proved");
    };
    fmt::print("\nWhere the bound of {} is lost\n", label(bound));
    fmt::print(
        "  product of norms {:.8g}, ECLipsE-Fast {}, Combettes-Pesquet {}, proved {:.10g}, pattern floor "
        "{:.8g}\n",
        bound.product.value(), shown(comparison.eclipse_fast ? comparison.eclipse_fast->upper.value() : 0),
        shown(comparison.combettes_pesquet ? comparison.combettes_pesquet->value() : 0), bound.upper.value(),
        comparison.floor.slope.value());
    for (const std::string& sentence :
         explain(comparison, bound.product.value(), bound.upper.value(), slope_found(bound)))
      fmt::print("  {}\n", sentence);
  }
}

void print_ranges(const files::Network& network, const CertifyOutput& output) {
  if (!output.ranges.empty())
    fmt::print(
        "\nRange over the box, of the exact function, proved (attained by points in brackets), in {}{}\n",
        output_unit(network),
        output.ranges_cut_short ? "; interrupted before the box was divided, so the range is wide" : "");
  for (const lipschitz::CertifiedRange& range : output.ranges) {
    const std::string many =
        range.neighbours_at_most > 0 ? " up to " + counted(range.neighbours_at_most, "neighbour") : "";
    fmt::print("  {}{}: {:.6g} ({:.6g}) .. ({:.6g}) {:.6g}", range.function.name(), many, range.lower,
               range.least.value, range.greatest.value, range.upper);
    // Without silent compositions the jump hardly depends on the number of neighbours, so it is printed only once.
    const bool has_jump =
        range.neighbours_at_most == 1 || (range.neighbours_at_most > 1 && !network.silent.empty());
    if (has_jump) fmt::print("; a neighbour at a cut-off: a jump of at most {:.6g}", range.jump);
    fmt::print("\n");
    const auto* const stated = in_certificate(output, range.function, range.neighbours_at_most);
    if (stated == nullptr) continue;
    const auto index = static_cast<std::size_t>(range.output);
    fmt::print("    in the certificate: {:.6g} .. {:.6g}{}\n", stated->lower[index], stated->upper[index],
               has_jump ? fmt::format(", a jump of at most {:.6g}", *stated->jump) : "");
  }
  if (!output.float32_errors.empty())
    fmt::print(
        "\nFloat32 evaluation in the order of summation of the exported code, against the exact\n"
        "function over the box, proved, in {}\n",
        output_unit(network));
  for (const lipschitz::Float32Error& error : output.float32_errors) {
    const std::string many =
        error.neighbours_at_most > 0 ? " up to " + counted(error.neighbours_at_most, "neighbour") : "";
    fmt::print("  {}{}: {:.4g} (arithmetic {:.4g}, conversion of the inputs {:.4g})", error.function.name(),
               many, error.total.value(), error.evaluation.value(), error.inputs.value());
    const auto* const stated = in_certificate(output, error.function, error.neighbours_at_most);
    fmt::print("{}\n", stated != nullptr && stated->float32_error[check::kInOrder]
                           ? fmt::format("; in the certificate: {:.4g}, and for any order {:.4g}",
                                         *stated->float32_error[check::kInOrder],
                                         *stated->float32_error[check::kAnyOrder])
                           : "");
  }
}

void print_arithmetic(const CertifyOutput& output) {
  if (output.ranges.empty()) return;
  fmt::print("\nLipschitz bounds, ranges and jumps are of the exact function of the stored weights. {}\n",
             output.float32_errors.empty()
                 ? "This says nothing about a float32 evaluation."
                 : "A float32 evaluation has steps and may\nleave them, by up to the float32 error.");
}

void print_laws(const files::Network& network, const Certification& found) {
  if (found.laws.empty()) return;
  fmt::print("\nSeveral neighbours at once{}{}\n",
             network.phi.count(files::kGroundKind) == 1 ? ", and the ground's input with them" : "",
             found.laws.front().domain == "box" ? ", all in the box" : "");
  for (const lipschitz::CertifiedLaw& law : found.laws) {
    const char* meaning = law.law == lipschitz::LawKind::kAllStacked ? "|df| <= L sqrt(sum_j |dx_j|^2)"
                          : law.law == lipschitz::LawKind::kAllMax   ? "|df| <= L max_j |dx_j|"
                                                                     : "|df| <= L |d own state|";
    fmt::print("  {:<24} rho:{:<8} {:<9} {:<11} {:>14.10g}  {}\n", group_label(law.neighbours), law.rho,
               law.block, name(law.law), law.upper.value(), meaning);
  }
}

}  // namespace

void print_certification(const files::Network& network, const CertifyOutput& output) {
  print_heading(network, output);
  print_chains(network, output.found);
  print_layers(network, output.found);
  print_bounds(network, output);
  print_laws(network, output.found);
  print_comparisons(output);
  print_ranges(network, output);
  print_arithmetic(output);
}

}  // namespace swarmcert::analysis
