#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <memory>
#include <sstream>

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
  std::string as;
  std::string blocks;
  std::string neighbours;
  std::string domain;
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
    if (bound.block != "all" || !bound.scale.empty()) continue;
    const double lower = bound.lower.witness ? bound.lower.witness->slope.value() : 0;
    verdicts.push_back(bound.upper.value() <= max_lipschitz ? Verdict::kProved
                       : lower > max_lipschitz              ? Verdict::kRefuted
                                                            : Verdict::kInconclusive);
  }
  return all_of(verdicts);
}

Json witness_json(const CertifiedBound& bound) {
  if (!bound.lower.witness) return nullptr;
  Json others = Json::array();
  for (std::size_t j = 0; j < bound.lower.witness->others.size(); ++j) {
    others.push_back({{"network", bound.lower.other_networks[j]}, {"x", bound.lower.witness->others[j]}});
  }
  return {{"x", bound.lower.witness->x}, {"y", bound.lower.witness->y}, {"others", std::move(others)}};
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
    Json json = summary(network, bound);
    json["lower_witness"] = witness_json(bound);
    json["product_upper"] = bound.product.value();
    json["search_rounds"] = bound.lower.rounds;
    if (bound.sdp.stop != lipschitz::LipSdpStop::kNothingRun) json["sdp_stop"] = name(bound.sdp.stop);
    bounds.push_back(std::move(json));
  }
  for (const lipschitz::CertifiedLaw& law : found.laws) bounds.push_back(summary(network, law));
  Json result = result_head("certify", input_files(network));
  result["seed"] = options.certify.lower.seed;
  result["as"] = found.as_float32 ? Json("float32") : Json();
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

/// "set:small:large", "set:small:large position", "set:small:large scaled".
std::string label(const CertifiedBound& bound) {
  return bound.function + (bound.block == "all" ? "" : " " + bound.block) +
         (bound.scale.empty() ? "" : " scaled");
}

void print_bounds(const files::Network& network, const Certification& found) {
  std::size_t width = 8;
  for (const CertifiedBound& bound : found.bounds) width = std::max(width, label(bound).size());
  fmt::print("\nLipschitz constants over {}, Euclidean norms\n",
             found.domain.empty() ? "all inputs" : "the box");
  fmt::print("  {:<{}}  {:>14}  {:<7}  {:>12}  {:>14}  {:>6}  {}\n", "function", width, "proved upper",
             "method", "product", "witnessed", "ratio", "unit");
  for (const CertifiedBound& bound : found.bounds) {
    const double lower = bound.lower.witness ? bound.lower.witness->slope.value() : 0;
    fmt::print("  {:<{}}  {:>14.10g}  {:<7}  {:>12.8g}  {:>14}  {:>6}  {}\n", label(bound), width,
               bound.upper.value(), name(bound.method), bound.product.value(),
               bound.lower.witness ? fmt::format("{:.8g}", lower) : "-",
               lower > 0 ? fmt::format("{:.3f}", bound.upper.value() / lower) : "-",
               files::unit(network, bound.function, bound.block));
    const bool unproved = !bound.proof && !bound.sdp.proof;
    if (unproved && bound.sdp.stop != lipschitz::LipSdpStop::kNothingRun) {
      fmt::print("    the semidefinite program gave no bound that could be proved: {}\n",
                 name(bound.sdp.stop));
    }
  }
  if (!network.rho.empty()) {
    fmt::print("  set: per neighbour that moves, whatever the number and the places of the others\n");
  }
  const auto is_block = [](const CertifiedBound& bound) { return bound.block == "position"; };
  if (std::any_of(found.bounds.begin(), found.bounds.end(), is_block))
    fmt::print("  blocks add up: |df| <= L_position |dp| + L_velocity |dv|\n");
}

std::string label(const lipschitz::Neighbours& neighbours) {
  std::string text;
  for (const auto& [kind, count] : neighbours)
    text += fmt::format("{}{} {}", text.empty() ? "" : " + ", count, kind);
  return text;
}

void print_laws(const files::Network& network, const Certification& found) {
  if (found.laws.empty()) return;
  fmt::print("\nSeveral neighbours at once{}\n",
             network.phi.count(files::kGroundKind) == 1 ? ", and the ground's input with them" : "");
  for (const lipschitz::CertifiedLaw& law : found.laws) {
    const char* meaning = law.law == lipschitz::LawKind::kAllStacked ? "|df| <= L sqrt(sum_j |dx_j|^2)"
                          : law.law == lipschitz::LawKind::kAllMax   ? "|df| <= L max_j |dx_j|"
                                                                     : "|df| <= L |d own state|";
    fmt::print("  {:<24} rho:{:<8} {:<9} {:<11} {:>14.10g}  {}\n", label(law.neighbours), law.rho, law.block,
               name(law.law), law.upper.value(), meaning);
  }
}

/// "3": as many of each kind; "small=1,large=2": that group.
void parse_neighbours(const std::string& text, lipschitz::ClaimOptions& claims) {
  const auto refuse = [&text]() {
    throw UsageError("--neighbours " + text + ": give a number (3) or a group (small=1,large=2)");
  };
  const auto number = [&refuse](const std::string& digits) {
    int value = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (error != std::errc() || end != digits.data() + digits.size() || value < 1 || value > 1000000)
      refuse();
    return value;
  };
  if (text.find('=') == std::string::npos) {
    claims.neighbours = number(text);
    return;
  }
  std::istringstream list(text);
  for (std::string item; std::getline(list, item, ',');) {
    const std::size_t equals = item.rfind('=');
    if (equals == std::string::npos ||
        !claims.mixture.emplace(item.substr(0, equals), number(item.substr(equals + 1))).second)
      refuse();
  }
}

void parse_blocks(const std::string& text, lipschitz::ClaimOptions& claims) {
  std::istringstream list(text);
  for (std::string item; std::getline(list, item, ',');) claims.blocks.push_back(item);
}

/// certify(); what the options ask for and NET has not is a matter of usage.
Certification certify_or_refuse(const files::Network& network, const lipschitz::CertifyOptions& options) {
  try {
    return certify(network, options);
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  }
}

int run(Options options, const CommonOptions& common) {
  refuse_to_replace(common, options.output);
  refuse_to_replace(common, common.json);
  if (options.method == "branch")
    throw UsageError(
        "--method branch is not part of this version: product and sdp bound every input, and so every box");
  if (!options.neighbours.empty()) parse_neighbours(options.neighbours, options.certify);
  parse_blocks(options.blocks, options.certify);
  files::Network network = load_net(options.network);
  if (options.as == "float32") network = files::as_float32(std::move(network));
  if (!options.domain.empty()) options.certify.domain = lipschitz::read_domain(options.domain, network);
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

  Certification found = certify_or_refuse(network, options.certify);
  found.as_float32 = options.as == "float32";
  const Verdict verdict = judge(found, options.max_lipschitz);
  if (!options.output.empty()) {
    files::write_file(options.output, files::to_text(certificate(network, found)), common.force);
  }
  write_result(common, result_json(options, network, found, verdict));
  if (common.prints_text()) {
    print_layers(network, found);
    print_bounds(network, found);
    print_laws(network, found);
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
            ->check(CLI::IsMember({"auto", "product", "sdp", "branch"}))
            ->capture_default_str();
        app.add_option("--as", options->as,
                       "Certify the weights rounded to this precision, as a C compiler flashes them")
            ->check(CLI::IsMember({"float32"}));
        app.add_flag(
            "--blocks{every}", options->blocks,
            "Bounds per block of inputs as well: --blocks for all, or --blocks=position,velocity,x2");
        app.add_option("--scale", options->certify.scale,
                       "Bounds in the norm sqrt(sum (dx_k / scale_k)^2) as well: one number per input")
            ->delimiter(',');
        app.add_option(
            "--neighbours", options->neighbours,
            "Laws for several neighbours: a number of each kind, or a group such as small=1,large=2");
        app.add_option("--domain", options->domain,
                       "box.toml: bounds for inputs in this box only (schema swarmcert/box/1, lower, upper)");
        app.add_option("--gamma", options->gamma, "Limit that every layer's spectral norm must keep")
            ->check(CLI::PositiveNumber);
        app.add_option("--max-lipschitz", options->max_lipschitz,
                       "Limit on the Lipschitz constant of the network, or of every set function")
            ->check(CLI::PositiveNumber);
        app.add_option(
               "--nodes", options->certify.lower.rounds,
               "Rounds of the search for lower bounds, per function; 0: none (default: 40, fewer for large "
               "networks)")
            ->check(CLI::NonNegativeNumber);
        app.add_option("--time", options->certify.lower.seconds,
                       "End the search for a lower bound after the round in which this many seconds pass")
            ->check(CLI::PositiveNumber);
        app.add_option("--seed", options->certify.lower.seed, "Of the search for lower bounds")
            ->capture_default_str();
        app.add_option("-o,--output", options->output, "Where the certificate goes");
        app.add_option("--report", options->report, "Folder for an HTML report with its plots");
        return [options](const CommonOptions& common) { return run(*options, common); };
      }};
}

}  // namespace swarmcert::analysis
