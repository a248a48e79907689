#include <fmt/core.h>

#include <algorithm>
#include <memory>

#include "analysis/certify_report.h"
#include "analysis/commands/command.h"
#include "analysis/progress.h"
#include "lipschitz/certify.h"
#include "nn/files/file_io.h"
#include "nn/files/functions.h"

namespace swarmcert::analysis {
namespace {

using files::Json;
using lipschitz::Certification;
using lipschitz::CertifiedBound;
using lipschitz::CertifiedLayer;
using lipschitz::Verdict;

struct Options {
  files::NetworkArguments network;
  std::string method = "auto";
  std::string output;
  std::string report;
  double gamma = 0;
  double max_lipschitz = 0;
  lipschitz::CertifyOptions certify;
};

bool is_composed(const CertifiedBound& bound) {
  return bound.function == "network" || bound.function.rfind("set:", 0) == 0;
}

/// Refuted if anything is, inconclusive if anything else is, proved if all is.
Verdict all_of(const std::vector<Verdict>& verdicts) {
  Verdict total = Verdict::kProved;
  for (const Verdict verdict : verdicts) {
    if (verdict == Verdict::kRefuted) return Verdict::kRefuted;
    if (verdict == Verdict::kInconclusive) total = Verdict::kInconclusive;
  }
  return total;
}

/// Whether gamma holds in every layer and --max-lipschitz for every composed function, where they are stated.
Verdict judge(const Certification& found, double max_lipschitz) {
  std::vector<Verdict> verdicts;
  for (const CertifiedLayer& layer : found.layers) {
    if (layer.respects_gamma) verdicts.push_back(*layer.respects_gamma);
  }
  for (const CertifiedBound& bound : found.bounds) {
    if (max_lipschitz <= 0 || !is_composed(bound)) continue;
    const double lower = bound.witness ? bound.witness->slope.value() : 0;
    verdicts.push_back(bound.upper.value() <= max_lipschitz ? Verdict::kProved
                       : lower > max_lipschitz              ? Verdict::kRefuted
                                                            : Verdict::kInconclusive);
  }
  return all_of(verdicts);
}

Json witness_json(const CertifiedBound& bound) {
  if (!bound.witness) return nullptr;
  Json others = Json::array();
  for (std::size_t j = 0; j < bound.witness->others.size(); ++j) {
    others.push_back({{"network", bound.other_networks[j]}, {"x", bound.witness->others[j]}});
  }
  return {{"x", bound.witness->x}, {"y", bound.witness->y}, {"others", std::move(others)}};
}

Json result_json(const Options& options, const files::Network& network, const Certification& found,
                 Verdict verdict) {
  Json layers = Json::array();
  for (const CertifiedLayer& layer : found.layers) {
    Json respects;
    if (layer.respects_gamma == Verdict::kProved) respects = true;
    if (layer.respects_gamma == Verdict::kRefuted) respects = false;
    layers.push_back({{"network", layer.network},
                      {"name", layer.name},
                      {"spectral_norm", {layer.norm.norm.lower.value(), layer.norm.norm.upper.value()}},
                      {"respects_gamma", respects}});
  }
  Json bounds = Json::array();
  for (const CertifiedBound& bound : found.bounds) {
    Json json = {{"function", bound.function},
                 {"domain", "global"},
                 {"block", "all"},
                 {"law", bound.function.rfind("set:", 0) == 0 ? "one_neighbour" : "none"},
                 {"norm", "l2"},
                 {"unit", files::unit(network, bound.function)},
                 {"upper", bound.upper.value()},
                 {"upper_method", name(bound.method)},
                 {"lower", nullptr},
                 {"lower_witness", witness_json(bound)},
                 {"product_upper", bound.product.value()},
                 {"search_rounds", bound.search_rounds}};
    if (bound.witness) json["lower"] = bound.witness->slope.value();
    if (bound.sdp.stop != lipschitz::LipSdpStop::kNothingRun) json["sdp_stop"] = name(bound.sdp.stop);
    bounds.push_back(std::move(json));
  }
  Json result = result_head("certify", input_files(network));
  result["seed"] = options.certify.seed;
  result["gamma"] = found.gamma ? Json(found.gamma->value) : Json();
  result["max_lipschitz"] = options.max_lipschitz > 0 ? Json(options.max_lipschitz) : Json();
  result["layers"] = std::move(layers);
  result["bounds"] = std::move(bounds);
  result["verdict"] = name(verdict);
  return result;
}

std::string sizes(const files::Weights& weights) {
  std::string text = std::to_string(weights.inputs());
  for (const files::Layer& layer : weights.layers) text += "-" + std::to_string(layer.outputs);
  return text;
}

void print_layers(const files::Network& network, const Certification& found) {
  fmt::print("Spectral norms, enclosed from both sides in exact arithmetic\n");
  for (const auto& [name, weights] : files::parts(network)) {
    fmt::print("  {}  {}  ({}, {})\n", name, weights->path, sizes(*weights), files::name(weights->precision));
    for (const CertifiedLayer& layer : found.layers) {
      if (layer.network != name) continue;
      const double lower = layer.norm.norm.lower.value();
      const double upper = layer.norm.norm.upper.value();
      std::string remark;
      if (layer.respects_gamma) {
        const double value = found.gamma->value;
        const bool per_layer = found.gamma->scope == files::GammaStatement::Scope::kLayer;
        const std::string limit =
            per_layer ? fmt::format("gamma {}", value) : fmt::format("its share of gamma {}", value);
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

void print_bounds(const files::Network& network, const Certification& found) {
  std::size_t width = 8;
  for (const CertifiedBound& bound : found.bounds) width = std::max(width, bound.function.size());
  fmt::print("\nLipschitz constants over all inputs, Euclidean norms\n");
  fmt::print("  {:<{}}  {:>14}  {:<7}  {:>12}  {:>14}  {:>6}  {}\n", "function", width, "proved upper",
             "method", "product", "witnessed", "ratio", "unit");
  for (const CertifiedBound& bound : found.bounds) {
    const double lower = bound.witness ? bound.witness->slope.value() : 0;
    fmt::print("  {:<{}}  {:>14.10g}  {:<7}  {:>12.8g}  {:>14}  {:>6}  {}\n", bound.function, width,
               bound.upper.value(), name(bound.method), bound.product.value(),
               bound.witness ? fmt::format("{:.8g}", lower) : "-",
               lower > 0 ? fmt::format("{:.3f}", bound.upper.value() / lower) : "-",
               files::unit(network, bound.function));
    const bool unproved = !bound.proof && !bound.sdp.proof;
    if (unproved && bound.sdp.stop != lipschitz::LipSdpStop::kNothingRun) {
      fmt::print("    the semidefinite program gave no bound that could be proved: {}\n",
                 name(bound.sdp.stop));
    }
  }
  if (!network.rho.empty()) {
    fmt::print("  set: per neighbour that moves, whatever the number and the places of the others\n");
  }
}

int run(Options options, const CommonOptions& common) {
  refuse_to_replace(common, options.output);
  refuse_to_replace(common, common.json);
  const files::Network network = load_net(options.network);
  if (options.gamma != 0) options.certify.gamma = files::GammaStatement{options.gamma};
  options.certify.method = options.method == "sdp"       ? lipschitz::UpperMethod::kSdp
                           : options.method == "product" ? lipschitz::UpperMethod::kProduct
                                                         : lipschitz::UpperMethod::kAuto;
  options.certify.jobs = common.jobs;
  Progress progress(common.quiet);
  options.certify.progress = [&progress](int done, int total, const std::string& what) {
    progress.show(done, total, what);
  };
  const CancelOnInterrupt interrupt;
  options.certify.cancelled = interrupt.flag();

  const Certification found = certify(network, options.certify);
  const Verdict verdict = judge(found, options.max_lipschitz);
  if (!options.output.empty()) {
    files::write_file(options.output, files::to_text(certificate(network, found)), common.force);
  }
  write_result(common, result_json(options, network, found, verdict));
  if (common.prints_text()) {
    print_layers(network, found);
    print_bounds(network, found);
    if (options.max_lipschitz > 0)
      fmt::print("\nlimit: Lipschitz constant at most {}\n", options.max_lipschitz);
    if (!options.output.empty()) fmt::print("\ncertificate: {}\n", options.output);
    fmt::print("verdict: {}\n", name(verdict));
  }
  if (!options.report.empty()) {
    const std::string path = write_certify_report(network, found, verdict, options.report, common.force);
    if (common.prints_text()) fmt::print("report: {}\n", path);
  }
  return verdict == Verdict::kProved ? kDone : verdict == Verdict::kRefuted ? kViolated : kInconclusive;
}

}  // namespace

Command certify_command() {
  return {
      "certify", "Spectral norms and Lipschitz bounds of a network that hold in exact arithmetic",
      "Upper bounds are proved in exact arithmetic for the weights as stored; the certificate (-o) holds "
      "the proofs\n"
      "and 'swarmcert check' verifies them without an optimiser. Lower bounds are slopes between two "
      "float32 points.\n"
      "Verdict: proved (exit 0), refuted (1) or inconclusive (4), of --gamma and --max-lipschitz where "
      "given, and of\n"
      "the gamma that a network.toml states.\n\n"
      "Example: swarmcert certify nn/networks/demo/network.toml --max-lipschitz 500 -o cert.json",
      [](CLI::App& app) {
        const auto options = std::make_shared<Options>();
        declare_network(app, options->network);
        app.add_option(
               "--method", options->method,
               "Upper bound: product of spectral norms, sdp (LipSDP-Neuron), or auto, the smaller one")
            ->check(CLI::IsMember({"auto", "product", "sdp"}))
            ->capture_default_str();
        app.add_option("--gamma", options->gamma, "Limit that every layer's spectral norm must keep")
            ->check(CLI::PositiveNumber);
        app.add_option("--max-lipschitz", options->max_lipschitz,
                       "Limit on the Lipschitz constant of the network, or of every set function")
            ->check(CLI::PositiveNumber);
        app.add_option(
               "--nodes", options->certify.search_rounds,
               "Rounds of the search for lower bounds, per function; 0: none (default: 40, fewer for large "
               "networks)")
            ->check(CLI::NonNegativeNumber);
        app.add_option("--time", options->certify.search_seconds,
                       "End the search for a lower bound after the round in which this many seconds pass")
            ->check(CLI::PositiveNumber);
        app.add_option("--seed", options->certify.seed, "Of the search for lower bounds")
            ->capture_default_str();
        app.add_option("-o,--output", options->output, "Where the certificate goes");
        app.add_option("--report", options->report, "Folder for an HTML report with its plots");
        return [options](const CommonOptions& common) { return run(*options, common); };
      }};
}

}  // namespace swarmcert::analysis
