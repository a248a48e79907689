#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <limits>
#include <memory>

#include "analysis/cli/command_line.h"
#include "analysis/cli/host.h"
#include "analysis/cli/progress.h"
#include "analysis/commands/certify/certify_output.h"
#include "analysis/commands/certify/certify_report.h"
#include "analysis/commands/commands.h"
#include "analysis/commands/shared/output_folder.h"
#include "lipschitz/certify.h"
#include "lipschitz/checker/canonical_network.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/base/parallel.h"
#include "nn/base/text.h"
#include "nn/weights/chain.h"
#include "nn/weights/functions.h"
#include "nn/weights/samples.h"

namespace swarmcert::analysis {
namespace {

using lipschitz::Certification;
using lipschitz::CertifiedBound;
using lipschitz::CertifiedLayer;
using lipschitz::Verdict;

struct CertifyOptions {
  files::NetworkArguments network;
  std::string method = "auto";
  std::string as;
  std::vector<std::string> samples;
  double sample_tolerance = files::kSampleTolerance;
  std::string blocks;
  std::string neighbours;
  std::string domain;
  bool range = false;
  bool explain = false;
  double input_step = 0;
  int range_nodes = 0;  ///< RangeOptions::nodes
  std::string output;
  std::string report;
  std::optional<int> nodes;
  double seconds = 0;
  double gamma = 0;
  double max_lipschitz = 0;
  lipschitz::CertifyOptions certify;
};

/// kRefuted if any verdict is refuted; otherwise kInconclusive if any is inconclusive; otherwise kProved.
Verdict all_of(const std::vector<Verdict>& verdicts) {
  Verdict total = Verdict::kProved;
  for (const Verdict verdict : verdicts) {
    if (verdict == Verdict::kRefuted) return Verdict::kRefuted;
    if (verdict == Verdict::kInconclusive) total = Verdict::kInconclusive;
  }
  return total;
}

/// Judges gamma in every layer and --max-lipschitz for every composed function, as far as they are stated.
Verdict judge(const Certification& found, double max_lipschitz) {
  std::vector<Verdict> verdicts;
  for (const auto* const layers : {&found.layers, &found.stored})
    for (const CertifiedLayer& layer : *layers)
      if (layer.respects_gamma) verdicts.push_back(*layer.respects_gamma);
  for (const CertifiedBound& bound : found.bounds) {
    if (max_lipschitz <= 0 || !bound.function.is_whole()) continue;
    if (bound.block != "all" || !bound.scale.empty() || !bound.neighbours.empty()) continue;
    const double lower = bound.lower.witness ? bound.lower.witness->slope.value() : 0;
    verdicts.push_back(bound.upper.value() <= max_lipschitz ? Verdict::kProved
                       : lower > max_lipschitz              ? Verdict::kRefuted
                                                            : Verdict::kInconclusive);
  }
  return all_of(verdicts);
}

/// Parses "3" (the same number of each kind) or "small=1,large=2" (this group).
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
  for (const std::string& item : files::split_at_commas(text)) {
    const std::size_t equals = item.rfind('=');
    if (equals == std::string::npos ||
        !claims.mixture.emplace(item.substr(0, equals), number(item.substr(equals + 1))).second)
      refuse();
  }
}

bool is_block(const std::string& word) {
  if (word == "every" || word == "position" || word == "velocity") return true;
  return word.size() > 1 && word[0] == 'x' && word.find_first_not_of("0123456789", 1) == std::string::npos;
}

/// The value of --blocks is optional and NET may follow it: if NET is missing, a value that is not a list of blocks
/// is NET.
void parse_blocks(CertifyOptions& options) {
  std::vector<std::string> blocks = files::split_at_commas(options.blocks);
  if (!std::all_of(blocks.begin(), blocks.end(), is_block)) {
    if (!options.network.file.empty() || !options.network.phi.empty())
      throw UsageError("--blocks " + options.blocks +
                       ": name blocks (position, velocity, x0, x1, ...), or none for every block");
    options.network.file = options.blocks;
    blocks = {"every"};
  }
  options.certify.blocks = std::move(blocks);
}

/// Returns the recorded samples that lie beside NET: samples.json beside a network.toml, as `train` writes it, or
/// STEM.samples.json, .csv or .npz beside a weight file.
std::vector<std::string> samples_beside(const CertifyOptions& options) {
  if (host() != nullptr || options.network.file.empty()) return {};
  const std::filesystem::path net(options.network.file);
  std::vector<std::filesystem::path> candidates;
  if (net.extension() == ".toml") candidates.push_back(net.parent_path() / "samples.json");
  for (const char* const ending : {".samples.json", ".samples.csv", ".samples.npz"})
    candidates.push_back(net.parent_path() / (net.stem().string() + ending));
  for (const std::filesystem::path& candidate : candidates)
    if (std::filesystem::is_regular_file(candidate)) return {candidate.string()};
  return {};
}

/// Compares NET with recorded samples of its outputs: those that are named, else those beside NET.
/// @throws InputError if they differ.
std::map<files::FunctionId, files::SampleAgreement> compare_samples(const files::Network& network,
                                                                    const CertifyOptions& options) {
  std::map<files::FunctionId, files::SampleAgreement> result;
  for (const std::string& argument : options.samples.empty() ? samples_beside(options) : options.samples) {
    for (const auto& [part, samples] : files::read_samples(argument, network)) {
      if (!result.emplace(part, files::hold_against(network, part, samples, options.sample_tolerance)).second)
        throw UsageError("--samples " + argument + ": there are samples of " + part + " already");
    }
  }
  return result;
}

/// Returns what was guessed about the parts, unless recorded samples confirm it.
std::vector<std::string> assumptions(const files::Network& network,
                                     const std::map<files::FunctionId, files::SampleAgreement>& samples) {
  std::vector<std::string> result;
  for (const auto& [part, weights] : files::parts(network)) {
    if (samples.count(part) == 1) continue;
    for (const std::string& guess : weights->assumed) result.push_back(part.name() + ": " + guess);
  }
  return result;
}

/// Calls certify(); options that NET does not support are usage errors.
Certification certify_or_refuse(const files::Network& network, const lipschitz::CertifyOptions& options) {
  try {
    return certify(network, options);
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  } catch (const files::InputError&) {
    throw;
  } catch (const std::runtime_error& error) {  // numbers so large or small that no bound can be computed
    const files::Weights& first = *files::parts(network).begin()->second;
    throw files::InputError({network.path.empty() ? first.path : network.path, "", "weights", "",
                             error.what(), "scale the network's inputs and outputs to numbers near one"});
  }
}

void add_comparisons(const files::Network& network, const lipschitz::CertifyOptions& options,
                     CertifyOutput& output) {
  const std::vector<CertifiedBound>& bounds = output.found.bounds;
  output.comparisons.resize(bounds.size());
  files::parallel_for(static_cast<int>(bounds.size()), options.jobs, [&](int i) {
    const CertifiedBound& bound = bounds[static_cast<std::size_t>(i)];
    if (bound.block == "all" && bound.scale.empty() && bound.neighbours.empty())
      output.comparisons[static_cast<std::size_t>(i)] = lipschitz::compare(
          network, bound.function, bound.block, bound.scale, lipschitz::Stop(options.cancelled));
  });
}

/// Adds ranges and float32 errors over the box of --domain, or over the set that the clamp lets through.
void add_ranges(const files::Network& network, const CertifyOptions& options, Progress& progress,
                CertifyOutput& output) {
  const lipschitz::Domain domain =
      options.domain.empty() ? lipschitz::clamp_domain(network) : options.certify.domain;
  if (domain.empty()) throw UsageError("--range needs a box: give --domain, or a clamp in network.toml");
  std::map<files::FunctionId, double> bounds, slopes;
  std::map<std::string, double> rho_bounds;
  for (const CertifiedBound& bound : output.found.bounds) {
    if (bound.block != "all" || !bound.scale.empty() || !bound.neighbours.empty()) continue;
    bounds[bound.function] = bound.upper.value();
    if (bound.domain == "global") slopes[bound.function] = bound.upper.value();
    if (bound.function.is_rho()) rho_bounds[bound.function.kind()] = bound.upper.value();
  }
  lipschitz::RangeOptions range;
  range.neighbours = std::max(1, options.certify.neighbours);
  range.jobs = options.certify.jobs;
  range.nodes = options.range_nodes;
  range.progress = [&progress](int done, int total) { progress.show(done, total, "ends of the range"); };
  const lipschitz::Stop stop(options.certify.cancelled);
  output.ranges_cut_short = stop.now();
  if (output.ranges_cut_short) range.nodes = 1;  // wider, but still a proved enclosure
  output.ranges = lipschitz::ranges(network, domain, rho_bounds, range);
  const files::Parts parts = files::parts(network);
  const bool is_float32 = std::all_of(parts.begin(), parts.end(), [](const auto& part) {
    return part.second->precision == files::Precision::kFloat32 && part.second->is_relu();
  });
  lipschitz::ValueOptions values{
      range.neighbours, options.domain.empty(), is_float32, options.input_step, {}, slopes};
  for (const lipschitz::CertifiedLayer& layer : output.found.layers)
    values.norms[layer.network].push_back(layer.norm.norm.upper.value());
  output.found.values = lipschitz::certified_values(network, domain, rho_bounds, values);
  if (!is_float32) return;  // the vehicle has other weights (--as float32), or functions of unknown rounding
  lipschitz::Float32Options float32;
  float32.neighbours = range.neighbours;
  float32.input_step = options.input_step;
  float32.jobs = range.jobs;
  float32.stop = stop;
  float32.nodes = range.nodes;
  output.float32_errors = lipschitz::float32_errors(network, domain, bounds, float32);
}

/// Float32 errors, and branch and bound without a box, require ReLU.
void refuse_what_is_for_relu(const files::Network& network, const CertifyOptions& options) {
  struct Asked {
    bool is_asked;
    const char* option;
  };
  const Asked all[] = {
      {options.explain, "--explain"},
      {options.input_step > 0, "--input-step, for the float32 error,"},
      {options.method == "branch" && options.domain.empty(), "--method branch without --domain"}};
  for (const Asked& one : all) {
    if (one.is_asked) files::require_relu(network, std::string(one.option) + " is for ReLU networks");
  }
}

/// Reads NET and related files, and converts command-line words to options.
files::Network read_network(CertifyOptions& options) {
  if (!options.neighbours.empty()) parse_neighbours(options.neighbours, options.certify);
  parse_blocks(options);
  files::Network network = load_any_net(options.network);
  refuse_what_is_for_relu(network, options);
  if (!options.neighbours.empty() && network.plain)
    throw UsageError(
        "--neighbours " + options.neighbours +
        ": the file holds one plain network, which has none; give a network.toml or --phi and --rho");
  if (options.as == "float32") network = files::as_float32(std::move(network));
  return network;
}

/// Sets --gamma, --method, and the limits of its search.
void set_method(CertifyOptions& options) {
  if (options.gamma != 0) options.certify.gamma = files::GammaStatement{options.gamma};
  options.certify.method = options.method == "branch"    ? lipschitz::UpperMethod::kBranch
                           : options.method == "sdp"     ? lipschitz::UpperMethod::kSdp
                           : options.method == "product" ? lipschitz::UpperMethod::kProduct
                                                         : lipschitz::UpperMethod::kAuto;
  const bool searches_boxes =
      options.method == "branch" || (options.method == "auto" && !options.domain.empty());
  if (!searches_boxes && (options.certify.branch.pairs > 0 || !options.certify.branch.better_slopes))
    throw UsageError(
        "--cuts and --default-slopes are options of branch and bound: they need --method branch, or "
        "--domain");
  if (searches_boxes) {
    if (options.method == "branch" && options.nodes == 0)
      throw UsageError("--nodes must be at least 1 with --method branch");
    if (options.nodes) options.certify.branch.nodes = std::max(1, *options.nodes);
    if (!options.nodes && options.seconds > 0) options.certify.branch.nodes = std::numeric_limits<int>::max();
    if (options.nodes == 0) options.certify.lower.rounds = 0;
  } else {
    options.certify.lower.rounds = options.nodes;
  }
}

/// Computes the bounds and the additional results that the options request.
CertifyOutput find_all(const files::Network& network, const CertifyOptions& options,
                       const std::map<files::FunctionId, files::SampleAgreement>& samples,
                       Progress& progress) {
  CertifyOutput output;
  output.found = certify_or_refuse(network, options.certify);
  output.found.as_float32 = options.as == "float32";
  output.seed = options.certify.lower.seed;
  output.max_lipschitz = options.max_lipschitz;
  output.domain_file = options.domain;
  if (options.explain) add_comparisons(network, options.certify, output);
  if (!options.domain.empty() || options.range) add_ranges(network, options, progress, output);
  output.verdict = judge(output.found, options.max_lipschitz);
  output.found.samples = samples;
  output.assumed = assumptions(network, samples);
  if (!output.assumed.empty()) output.verdict = Verdict::kInconclusive;
  return output;
}

void write_certificate(const files::Network& network, const CertifyOutput& output, const std::string& path,
                       bool force) {
  if (path.empty() && host() == nullptr) return;
  const std::string text = files::to_text(certificate(network, output.found));
  if (!path.empty()) files::write_file(path, text, force);
  if (host() != nullptr) host()->certificate_written = text;
}

/// Reads the files again and compares them with the network that the certificate carries.
/// @throws InputError if they were changed meanwhile.
void compare_with_files(const CertifyOptions& options, const files::Network& certified) {
  files::Network again = load_any_net(options.network);
  if (options.as == "float32") again = files::as_float32(std::move(again));
  const std::string difference = check::first_difference(certified, again);
  if (difference.empty()) return;
  throw files::InputError(
      {options.output, "", "", "", difference, "the files changed meanwhile: certify again"});
}

void print_all(const files::Network& network, const CertifyOptions& options, const CertifyOutput& output) {
  print_certification(network, output);
  if (options.max_lipschitz > 0)
    fmt::print("\nlimit: Lipschitz constant at most {}\n", options.max_lipschitz);
  if (!options.output.empty())
    fmt::print(
        "\ncertificate: {}\n  it carries the network; the files were read again and compared with it, tensor "
        "by "
        "tensor, by the same reader,\n  not by the formats' own libraries\n",
        options.output);
  fmt::print("verdict: {} for {}{}\n", name(output.verdict), files::chain_words(network),
             output.is_interrupted() ? ", from interrupted searches" : "");
}

int run_certify(CertifyOptions options, const CommonOptions& common) {
  refuse_to_replace(common, options.output);
  refuse_missing_folder(options.output);
  refuse_to_replace(common, common.json);
  refuse_folder(common, options.report);
  const files::Network network = read_network(options);
  const std::map<files::FunctionId, files::SampleAgreement> samples = compare_samples(network, options);
  if (!options.domain.empty()) options.certify.domain = lipschitz::read_domain(options.domain, network);
  set_method(options);
  Progress progress(common.quiet);
  options.certify.jobs = common.jobs;
  options.certify.progress = [&progress](int done, int total, const std::string& what) {
    progress.show(done, total, what);
  };
  // The flag is for computations without their own time limit; those with one report that the time is over rather
  // than a cancellation.
  constexpr double kLater_s = 0.1;
  const CancelOnInterrupt interrupt(options.seconds > 0 ? options.seconds + kLater_s : 0,
                                    CancelOnInterrupt::Term::kEndsInTime);
  options.certify.cancelled = interrupt.flag();
  options.certify.seconds = options.seconds;

  CertifyOutput output = find_all(network, options, samples, progress);
  write_certificate(network, output, options.output, common.force);
  if (!options.output.empty() && host() == nullptr) compare_with_files(options, network);
  const files::Node result = certify_result(network, output);
  write_result(common, result);
  if (common.prints_text()) print_all(network, options, output);
  if (!options.report.empty()) {
    const std::string path = write_certify_report(network, output, result, options.report, common.force);
    if (common.prints_text()) fmt::print("report: {}\n", path);
  }
  std::vector<std::string> next = network_words(options.network);
  if (options.output.empty())
    next.insert(next.end(), {"-o", "certificate.json"});
  else
    next.insert(next.begin(), options.output);
  next.insert(next.begin(), options.output.empty() ? "certify" : "check");
  print_next(common, next);
  return output.verdict == Verdict::kProved    ? kDone
         : output.verdict == Verdict::kRefuted ? kViolated
                                               : kInconclusive;
}

void declare_function(CLI::App& app, CertifyOptions& options) {
  app.add_option("--method", options.method,
                 "Upper bound: product (of spectral norms), sdp (LipSDP-Neuron; the layer-wise eclipse_fast "
                 "if its search is interrupted), branch (branch and bound over the box of --domain; of ReLU "
                 "networks without --domain over all inputs), or auto (the smallest: of the first three over "
                 "all inputs, of all four over a box). For activations other than ReLU, product and sdp use "
                 "their slopes on the box of --domain")
      ->check(CLI::IsMember({"auto", "product", "sdp", "branch"}))
      ->capture_default_str();
  app.add_option(
         "--samples", options.samples,
         "Inputs and outputs recorded from the trained network (CSV, .npz or JSON), which the certified "
         "function must reproduce, else exit 3; PART=FILE for a part of a deep set, e.g. phi:small=FILE. "
         "Default: "
         "samples.json beside a network.toml, or NAME.samples.json, .csv or .npz beside NAME.pth")
      ->allow_extra_args(false);
  app.add_option("--samples-tolerance", options.sample_tolerance,
                 "Tolerance for samples, relative to the range of their outputs")
      ->check(CLI::Range(0.0, 0.1))
      ->capture_default_str();
  app.add_option("--as", options.as,
                 "Certify the weights rounded to this precision, as they are stored in flash")
      ->check(CLI::IsMember({"float32"}));
}

/// @returns the option --blocks, whose value is optional.
const CLI::Option* declare_inputs(CLI::App& app, CertifyOptions& options) {
  auto* blocks = app.add_option("--blocks", options.blocks,
                                "Also bounds per block of inputs: for every block, or for the named ones, "
                                "e.g. position,velocity,x2")
                     ->expected(0, 1)
                     ->type_name("[LIST]")
                     ->default_str("every");
  app.add_option("--scale", options.certify.scale,
                 "Also bounds in the norm sqrt(sum (dx_k / scale_k)^2): one number per input")
      ->delimiter(',');
  app.add_option("--neighbours", options.neighbours,
                 "Bounds for several moving neighbours: a number of each kind, or a group such as "
                 "small=1,large=2. With --method branch also the bound for one neighbour that moves "
                 "among at most this many, all in the box");
  app.add_option("--domain", options.domain,
                 "box.toml: bounds for inputs in this box only (schema swarmcert/box/1, lower, upper)");
  return blocks;
}

void declare_search_on_a_box(CLI::App& app, CertifyOptions& options) {
  app.add_option("--cuts", options.certify.branch.pairs,
                 "Of branch and bound: maximum number of constraints per box from pairs of "
                 "incompatible activations. Gives fewer boxes and a shorter certificate for the same "
                 "bound, but takes more time")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  app.add_flag_callback(
      "--default-slopes", [&options] { options.certify.branch.better_slopes = false; },
      "Of branch and bound: disable the adaptive lower ReLU slopes (for comparison)");
}

void declare_limits(CLI::App& app, CertifyOptions& options) {
  app.add_flag("--range", options.range,
               "Range, jump at a cut-off and float32 error over the clamp's box; --domain implies it. If "
               "network.toml lists silent compositions, ranges and jumps include their output 0");
  app.add_option("--range-nodes", options.range_nodes,
                 "Maximum number of boxes of branch and bound per search for an end of a range, twice that "
                 "for linear forms over several neighbours, and of parts of the box for a float32 error "
                 "(default: 16000, fewer for large networks)")
      ->check(CLI::Range(1, 10'000'000));
  app.add_option("--input-step", options.input_step,
                 "Inputs are quantised to multiples of this (float32 error)")
      ->check(CLI::NonNegativeNumber);
  app.add_flag("--explain", options.explain,
               "Other bounds for comparison, and which layers make the bound loose");
  app.add_option("--gamma", options.gamma, "Limit on the spectral norm of every layer")
      ->check(CLI::PositiveNumber);
  app.add_option("--max-lipschitz", options.max_lipschitz,
                 "Limit on the Lipschitz constant of the network, or of every set function")
      ->check(CLI::PositiveNumber);
  app.add_option(
         "--nodes", options.nodes,
         "Where branch and bound runs (--domain, --method branch): boxes to examine, per bound (default: "
         "as many as take about ten seconds, or until --time); the same number gives the same result. "
         "Else: rounds of the search for lower bounds, per function; 0: none (default: 40, fewer for "
         "large networks)")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--time", options.seconds,
                 "Time limit of the whole command in seconds. Bounds are proved all the same; those whose "
                 "search was cut short have the status interrupted, as after Ctrl-C; SIGTERM ends the "
                 "command within a second, with its result if that is ready by then")
      ->check(CLI::PositiveNumber);
  app.add_option("--seed", options.certify.lower.seed, "Seed of the lower-bound search")
      ->capture_default_str();
  add_output(app, "-o,--output", options.output, "File for the certificate");
  add_output(app, "--report", options.report, "Folder for an HTML report with its plots");
}

}  // namespace

Command certify_command() {
  return {
      "certify", "Spectral norms and Lipschitz bounds of a network that hold in exact arithmetic",
      "Upper bounds are proved in exact arithmetic for the weights as stored; the certificate (-o) holds "
      "the proofs\n"
      "and 'swarmcert check' verifies them without an optimiser. Lower bounds are slopes between two "
      "float32 points,\n"
      "exact or, with smooth activations, rounded down.\n"
      "Verdict: proved (exit 0), refuted (1) or inconclusive (4), for --gamma and --max-lipschitz if "
      "given, and for\nthe gamma that a network.toml states. Inconclusive, whatever the bounds, if the order "
      "of the layers was guessed:\nstate it with --order or --select, or compare --samples.\n\n"
      "Example: swarmcert certify nn/networks/demo/network.toml --max-lipschitz 500 -o cert.json",
      [](CLI::App& app) {
        const auto options = std::make_shared<CertifyOptions>();
        declare_network(app, options->network);
        declare_function(app, *options);
        const CLI::Option* const blocks = declare_inputs(app, *options);
        declare_search_on_a_box(app, *options);
        declare_limits(app, *options);
        return [options, blocks](const CommonOptions& common) {
          if (blocks->count() > 0 && options->blocks.empty()) options->blocks = "every";
          return run_certify(*options, common);
        };
      },
      [](files::Record& record) { describe_certify(record, files::Network(), CertifyOutput()); }};
}

}  // namespace swarmcert::analysis
