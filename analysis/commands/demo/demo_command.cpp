#include <fmt/core.h>

#include <filesystem>
#include <memory>

#include "analysis/cli/bundled.h"
#include "analysis/cli/command_line.h"
#include "analysis/cli/progress.h"
#include "analysis/commands/certify/certify_output.h"
#include "analysis/commands/certify/certify_report.h"
#include "analysis/commands/commands.h"
#include "lipschitz/certify.h"
#include "lipschitz/checker/check.h"
#include "nn/base/file_io.h"
#include "nn/weights/functions.h"

namespace swarmcert::analysis {
namespace {

struct DemoOptions {
  std::string output = "swarmcert-demo";
};

int run_demo(const DemoOptions& options, const CommonOptions& common) {
  files::NetworkArguments arguments;
  arguments.file = bundled_folder("networks", "nn/networks") + "/demo/network.toml";
  const std::filesystem::path folder = options.output;
  const std::string certificate_path = (folder / "cert.json").string();
  refuse_to_replace(common, certificate_path);
  refuse_folder(common, (folder / "report").string());
  std::filesystem::create_directories(folder);

  const auto say = [&common](const std::string& text) {
    if (common.prints_text()) fmt::print("{}\n", text);
  };
  say(fmt::format("1. Certify the bundled network: swarmcert certify {} -o {}", arguments.file,
                  certificate_path));
  const files::Network network = files::load_network(arguments);
  lipschitz::CertifyOptions certify_options;
  certify_options.jobs = common.jobs;
  Progress progress(common.quiet);
  certify_options.progress = [&progress](int done, int total, const std::string& what) {
    progress.show(done, total, what);
  };
  const lipschitz::Certification found = certify(network, certify_options);
  files::write_file(certificate_path, files::to_text(certificate(network, found)), common.force);
  for (const lipschitz::CertifiedBound& bound : found.bounds) {
    say(fmt::format("   {:<18} proved <= {:<12.8g} witnessed >= {:<12.8g} {}", bound.function,
                    bound.upper.value(), bound.lower.witness ? bound.lower.witness->slope.value() : 0.0,
                    files::unit(network, bound.function)));
  }

  say(fmt::format("2. Check the certificate: swarmcert check {} {}", certificate_path, arguments.file));
  const check::CheckResult checked =
      check::check(files::read_json(certificate_path, check::kCertificateSchema), network);
  say(fmt::format("   {}: {}", checked.accepted ? "accepted" : "rejected", checked.reason));

  files::Json result = result_head("demo", input_files(network));
  result["certificate_sha256"] = files::sha256(files::read_file(certificate_path));
  result["accepted"] = checked.accepted;
  CertifyOutput output;
  output.found = found;
  output.verdict = lipschitz::Verdict::kProved;
  const std::string report =
      write_certify_report(network, output, result, (folder / "report").string(), common.force);
  say("3. Look at the report: " + report);
  write_result(common, result);
  return checked.accepted ? kDone : kViolated;
}

}  // namespace

Command demo_command() {
  return {
      "demo", "Certify and check a bundled network",
      "Certifies a network that ships with the tool and checks the certificate.\n\nExample: swarmcert demo",
      [](CLI::App& app) {
        const auto options = std::make_shared<DemoOptions>();
        add_output(app, "-o,--output", options->output, "Folder for the results")->capture_default_str();
        return [options](const CommonOptions& common) { return run_demo(*options, common); };
      }};
}

}  // namespace swarmcert::analysis
