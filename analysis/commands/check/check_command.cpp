#include <fmt/core.h>

#include <filesystem>
#include <memory>

#include "analysis/cli/command_line.h"
#include "analysis/cli/host.h"
#include "analysis/commands/commands.h"
#include "lipschitz/checker/check.h"
#include "nn/weights/chain.h"

namespace swarmcert::analysis {
namespace {

struct CheckOptions {
  std::string certificate;
  files::NetworkArguments network;
};

int run_check(const CheckOptions& options, const CommonOptions& common) {
  const bool is_in_memory = host() != nullptr && host()->certificate;
  if (!is_in_memory && std::filesystem::path(options.certificate).extension() == ".toml")
    throw UsageError("CERTIFICATE " + options.certificate +
                     ": is a TOML file; the certificate stands first: check cert.json network.toml");
  const files::Json certificate =
      is_in_memory ? files::parse_json(*host()->certificate, options.certificate, check::kCertificateSchema)
                   : files::read_json(options.certificate, check::kCertificateSchema);
  const files::Network network = check::with_stated_activations(certificate, load_any_net(options.network));
  const check::CheckResult verdict = check::check(certificate, network);

  std::vector<std::string> inputs;
  if (!is_in_memory) inputs.push_back(options.certificate);
  for (const std::string& path : input_files(network)) inputs.push_back(path);
  files::Json result = result_head("check", inputs);
  result["accepted"] = verdict.accepted;
  result["reason"] = verdict.reason;
  result["chain"] = files::chain_words(network);
  result["spectral_norms"] = verdict.spectral_norms;
  result["upper_bounds"] = verdict.upper_bounds;
  result["lower_bounds"] = verdict.lower_bounds;
  result["values"] = verdict.values;
  write_result(common, result);
  if (common.prints_text()) {
    if (verdict.accepted) {
      fmt::print("accepted: {}: {} spectral norms, {} upper bounds, {} lower bounds{}\n", verdict.reason,
                 verdict.spectral_norms, verdict.upper_bounds, verdict.lower_bounds,
                 verdict.values > 0 ? fmt::format(", values of {}", verdict.values) : "");
      fmt::print("for {}\n", files::chain_words(network));
    } else {
      fmt::print("rejected: {}\n", verdict.reason);
    }
  }
  return verdict.accepted ? kDone : kViolated;
}

}  // namespace

Command check_command() {
  return {"check", "Verify a certificate against the weights, independently of what wrote it",
          "Rebuilds every matrix inequality from the weights and verifies it in exact integer arithmetic, "
          "proofs on a box\n"
          "in double with every rounding accounted for; uses no optimiser. Accepted: exit 0. Rejected, with "
          "the reason: exit 1.\n\n"
          "Example: swarmcert check cert.json nn/networks/demo/network.toml",
          [](CLI::App& app) {
            const auto options = std::make_shared<CheckOptions>();
            app.add_option("CERTIFICATE", options->certificate, "Certificate that certify wrote with -o")
                ->required();
            declare_network(app, options->network);
            return [options](const CommonOptions& common) { return run_check(*options, common); };
          }};
}

}  // namespace swarmcert::analysis
