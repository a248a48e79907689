#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <memory>

#include "analysis/cli/command_line.h"
#include "analysis/cli/host.h"
#include "analysis/commands/commands.h"
#include "lipschitz/checker/check.h"
#include "nn/base/file_io.h"
#include "nn/weights/chain.h"
#include "nn/weights/functions.h"
#include "stability/bounds/tracking_bounds.h"
#include "stability/checker/check_tracking.h"

namespace swarmcert::analysis {
namespace {

struct CheckOptions {
  std::string certificate;
  files::NetworkArguments network;
  std::string gains, model;  ///< for a certificate of tracking gains
};

struct CheckResult {
  bool accepted = false;
  std::string reason, chain;
  int spectral_norms = 0, upper_bounds = 0, lower_bounds = 0, values = 0;
};

void describe(files::Record& record, const CheckResult& result) {
  record.field("accepted", result.accepted, "Whether every statement was verified in exact arithmetic.");
  record.field("reason", result.reason, "Why, or why not.");
  record.field("chain", result.chain, "The chain of operations that the certificate is about.");
  record.field("spectral_norms", result.spectral_norms, "Spectral norms that were verified.");
  record.field("upper_bounds", result.upper_bounds, "Upper bounds that were verified.");
  record.field("lower_bounds", result.lower_bounds, "Lower bounds that were verified.");
  record.field("values", result.values,
               "Functions whose range, jump and float32 error over a box were verified.");
}

/// Whether the text is a certificate of tracking gains. Certificates of networks can be long, so they are parsed only
/// once.
bool is_of_tracking(const std::string& text, const std::string& path) {
  if (text.find(check::kTrackingSchema) == std::string::npos) return false;
  const files::Json json = files::parse_json(text, path);
  return json.is_object() && json.value("schema", files::Json()) == check::kTrackingSchema;
}

bool is_close(double stated, double derived) {
  return std::abs(stated - derived) <= 1e-12 * std::abs(derived);
}

bool fits(const files::Json& entry, const char* key, double derived) {
  return is_close(files::parse_hex_float(entry[key].get<std::string>()), derived);
}

/// Whether an entry of an accepted certificate states the parameters of `loop`, up to rounding.
bool states(const files::Json& entry, const stability::AxisLoop& loop) {
  std::vector<double> stated = files::parse_hex_floats(entry["lags_s"]), derived;
  std::copy_if(loop.lags_s.begin(), loop.lags_s.end(), std::back_inserter(derived),
               [](double tau) { return tau > 0; });
  std::sort(stated.begin(), stated.end());
  std::sort(derived.begin(), derived.end());
  return fits(entry, "delay_s", loop.delay_s) && fits(entry, "mass_kg", loop.mass_kg) &&
         fits(entry, "Kp", loop.Kp) && fits(entry, "Kd", loop.Kd) && fits(entry, "Ki", loop.Ki) &&
         std::equal(stated.begin(), stated.end(), derived.begin(), derived.end(), is_close);
}

/// The same for an entry of a sampled loop.
bool states(const files::Json& entry, const stability::SampledLoop& loop) {
  return states(entry, loop.plant) && fits(entry, "period_s", loop.period_s) &&
         fits(entry, "integrator_step_s", loop.integrator_step_s);
}

/// Rejects an accepted certificate whose loops differ from those of the given files.
void compare_loops(const CheckOptions& options, const files::Json& certificate,
                   check::TrackingVerdict& verdict) {
  const stability::FlownLoop setup = stability::load_flown_loop(options.gains, options.model);
  const auto compare = [&](const char* kind, auto loop_of) {
    for (const files::Json& entry : certificate[kind]) {
      const auto loop = (setup.*loop_of)(stability::axis_of_name(entry["axis"].get<std::string>()));
      if (loop && states(entry, *loop)) continue;
      const std::string axis = entry["axis"].get<std::string>();
      verdict = {false, std::string(kind) + ": that of axis " + axis + " is not the one of the files given",
                 0, 0};
    }
  };
  compare("loops", &stability::FlownLoop::continuous);
  compare("sampled_loops", &stability::FlownLoop::sampled);
}

int check_gains(const CheckOptions& options, const CommonOptions& common, const std::string& text) {
  if (!options.network.file.empty() || !options.network.phi.empty())
    throw UsageError(options.certificate +
                     " is a certificate of tracking gains, not of a network: omit the network");
  const files::Json certificate = files::parse_json(text, options.certificate, check::kTrackingSchema);
  std::vector<std::string> inputs;
  if (host() == nullptr || !host()->certificate) inputs.push_back(options.certificate);
  const auto hash = [&inputs](const std::string& path) {
    if (path.empty()) return std::string();
    inputs.push_back(path);
    return files::sha256(files::read_file(path));
  };
  const std::string gains = hash(options.gains), model = hash(options.model);
  check::TrackingVerdict verdict = check::check_tracking(certificate, gains, model);
  if (verdict.accepted && !gains.empty() && !model.empty()) compare_loops(options, certificate, verdict);
  write_result(common, result_of("check", inputs, std::nullopt,
                                 CheckResult{verdict.accepted, verdict.reason, "tracking gains", 0,
                                             verdict.gains, 0, 0}));
  if (common.prints_text()) {
    if (verdict.accepted) {
      fmt::print("accepted: {}: {} gains of {} loops\n", verdict.reason, verdict.gains, verdict.loops);
      if (gains.empty() || model.empty())
        fmt::print("the loops were not compared with gains.toml and model.toml: --gains, --model\n");
    } else {
      fmt::print("rejected: {}\n", verdict.reason);
    }
  }
  return verdict.accepted ? kDone : kViolated;
}

int run_check(const CheckOptions& options, const CommonOptions& common) {
  const bool is_in_memory = host() != nullptr && host()->certificate;
  if (!is_in_memory && std::filesystem::path(options.certificate).extension() == ".toml")
    throw UsageError("CERTIFICATE " + options.certificate +
                     ": is a TOML file; the certificate comes first: check cert.json network.toml");
  std::string text = is_in_memory ? *host()->certificate : files::read_file(options.certificate);
  if (is_of_tracking(text, options.certificate)) return check_gains(options, common, text);
  if (!options.gains.empty() || !options.model.empty())
    throw UsageError("--gains and --model are for certificates of tracking gains; " + options.certificate +
                     " is none");
  const files::Json certificate = check::parse_certificate(text, options.certificate);
  text = std::string();  // frees the text, which may be as large as all that follows
  const files::Network network = load_any_net(check::with_stated_options(certificate, options.network));
  const check::CheckResult verdict = check::check(certificate, network);

  std::vector<std::string> inputs;
  if (!is_in_memory) inputs.push_back(options.certificate);
  for (const std::string& path : input_files(network)) inputs.push_back(path);
  write_result(common, result_of("check", inputs, std::nullopt,
                                 CheckResult{verdict.accepted, verdict.reason, files::chain_words(network),
                                             verdict.spectral_norms, verdict.upper_bounds,
                                             verdict.lower_bounds, verdict.values}));
  if (common.prints_text()) {
    if (verdict.accepted) {
      fmt::print("accepted: {}: {} spectral norms, {} upper bounds, {} lower bounds{}\n", verdict.reason,
                 verdict.spectral_norms, verdict.upper_bounds, verdict.lower_bounds,
                 verdict.values > 0 ? fmt::format(", values of {}", verdict.values) : "");
      fmt::print("for {}\nthe files hold this network: read again and compared tensor by tensor\n",
                 files::chain_words(network));
      for (const auto& [part, weights] : files::parts(network))
        for (const std::string& note : reading_notes(*weights)) fmt::print("  {}: {}\n", part.name(), note);
    } else {
      fmt::print("rejected: {}\n", verdict.reason);
    }
  }
  if (verdict.accepted) {
    std::vector<std::string> next = network_words(options.network);
    next.insert(next.begin(), "export");
    next.insert(next.end(), {"--certificate", options.certificate, "-o", "firmware"});
    print_next(common, next);
  }
  return verdict.accepted ? kDone : kViolated;
}

}  // namespace

Command check_command() {
  return {
      "check", "Verify a certificate against the weights, independently of the program that wrote it",
      "Rebuilds every matrix inequality from the network in the certificate and verifies it in exact integer "
      "arithmetic,\nproofs on a box in double with every rounding accounted for; uses no optimiser. Reads "
      "the "
      "weight files again and\ncompares them with that network, tensor by tensor. Accepted: exit 0. "
      "Rejected, "
      "with the reason: exit 1.\n"
      "A certificate of tracking gains needs no network; with --gains and --model, to which it must "
      "belong, the loops are derived again.\n\n"
      "Example: swarmcert check cert.json nn/networks/demo/network.toml\n"
      "         swarmcert check gains-cert.json --gains controller/gains/composite.toml",
      [](CLI::App& app) {
        const auto options = std::make_shared<CheckOptions>();
        app.add_option("CERTIFICATE", options->certificate,
                       "Certificate that certify or bound --verified wrote with -o")
            ->required();
        declare_network(app, options->network);
        app.add_option("--gains", options->gains,
                       "gains.toml to which a certificate of tracking gains must belong");
        app.add_option("--model", options->model,
                       "model.toml to which a certificate of tracking gains must belong");
        return [options](const CommonOptions& common) { return run_check(*options, common); };
      },
      fields_of<CheckResult>()};
}

}  // namespace swarmcert::analysis
