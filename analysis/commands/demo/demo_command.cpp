#include <fmt/core.h>

#include <filesystem>
#include <memory>

#include "analysis/cli/bundled.h"
#include "analysis/cli/command_line.h"
#include "analysis/cli/progress.h"
#include "analysis/commands/certify/certify_output.h"
#include "analysis/commands/certify/certify_report.h"
#include "analysis/commands/commands.h"
#include "analysis/commands/study/study_output.h"
#include "analysis/commands/study/study_report.h"
#include "lipschitz/certify.h"
#include "lipschitz/checker/check.h"
#include "nn/base/file_io.h"
#include "nn/weights/functions.h"
#include "stability/simulation/simulate.h"

namespace swarmcert::analysis {
namespace {

namespace fs = std::filesystem;

struct DemoOptions {
  std::string output = "swarmcert-demo";
};

struct DemoResult {
  std::string certificate_sha256;
  bool accepted = false;
  std::string headline, verdict;
};

void describe(files::Record& record, const DemoResult& result) {
  record.field("certificate_sha256", result.certificate_sha256, "Of the file cert.json.");
  record.field("accepted", result.accepted, "Whether the independent checker accepts the certificate.");
  record.object("study", "Of the flights.", [&](files::Record& study) {
    study.field("headline", result.headline, "What the model lacks, and what adding it changes.");
    study.field("verdict", result.verdict, "Of `study`.");
  });
}

/// Announces each step, with the command that runs it on its own.
class Speaker {
 public:
  explicit Speaker(const CommonOptions& common) : speaks_(common.prints_text()) {}
  void operator()(const std::string& text) const {
    if (speaks_) fmt::print("{}\n", text);
  }

 private:
  bool speaks_;
};

/// Certifies the bundled network, checks the certificate, and writes both with a report. Returns the path of the page.
std::string certify_network(const files::Network& network, const std::string& file, const fs::path& folder,
                            const CommonOptions& common, const Speaker& say, DemoResult& result) {
  const std::string certificate_path = (folder / "cert.json").string();
  say(fmt::format("1. Certify the bundled network: swarmcert certify {} -o {}", file, certificate_path));
  lipschitz::CertifyOptions options;
  options.jobs = common.jobs;
  Progress progress(common.quiet);
  options.progress = [&progress](int done, int total, const std::string& what) {
    progress.show(done, total, what);
  };
  const lipschitz::Certification found = certify(network, options);
  files::write_file(certificate_path, files::to_text(certificate(network, found)), common.force);
  for (const lipschitz::CertifiedBound& bound : found.bounds) {
    say(fmt::format("   {:<18} proved <= {:<12.8g} witnessed >= {:<12.8g} {}", bound.function.name(),
                    bound.upper.value(), bound.lower.witness ? bound.lower.witness->slope.value() : 0.0,
                    files::unit(network, bound.function)));
  }
  say(fmt::format("2. Check the certificate: swarmcert check {} {}", certificate_path, file));
  const check::CheckResult checked =
      check::check(files::read_json(certificate_path, check::kCertificateSchema), network);
  say(fmt::format("   {}: {}", checked.accepted ? "accepted" : "rejected", checked.reason));

  result.certificate_sha256 = files::sha256(files::read_file(certificate_path));
  result.accepted = checked.accepted;
  CertifyOutput output;
  output.found = found;
  output.verdict = lipschitz::Verdict::kProved;
  return write_certify_report(network, output, result_of("demo", input_files(network), std::nullopt, result),
                              (folder / "report").string(), common.force);
}

/// Simulates random walks of two vehicles with the effects of crazyflie-small-effects.toml into FOLDER/1 .. FOLDER/3.
void fly(const fs::path& folder, const std::string& models, bool force) {
  constexpr int kFlights = 3, kVehicles = 2;
  constexpr double kDuration_s = 25;
  const stability::Gains gains =
      stability::load_gains(bundled_folder("gains", "controller/gains") + "/crazyflie-small.toml");
  for (int flight = 1; flight <= kFlights; ++flight) {
    const auto seed = static_cast<std::uint64_t>(flight);
    stability::Swarm swarm({stability::read_model(models + "/crazyflie-small-effects.toml")},
                           std::vector<int>(kVehicles, 0));
    swarm.assume_lag(gains.motor_lag_s, gains.delay_s);
    stability::SimulationOptions how;
    how.loop.seed = seed;
    const stability::Simulation flown = stability::simulate(
        swarm, gains, *stability::make_task("random-walk", {kVehicles, kDuration_s, seed}), how, nullptr);
    const fs::path logs = folder / std::to_string(flight);
    fs::create_directories(logs);
    for (std::size_t i = 0; i < flown.logs.size(); ++i) {
      files::write_file((logs / fmt::format("cf{}_00", i + 1)).string(), stability::to_usd_log(flown.logs[i]),
                        force);
    }
  }
}

/// Simulates flights with effects that the studied model lacks, and studies them. Returns the path of the page.
std::string study_flights(const fs::path& folder, const CommonOptions& common, const Speaker& say,
                          DemoResult& result) {
  const std::string models = bundled_folder("models", "stability/models");
  const std::string model = models + "/crazyflie-small.toml", flights = (folder / "flights").string(),
                    output = (folder / "study").string();
  say(
      fmt::format("3. Fly with downwash, motor lag and drag, and ask what a model without them lacks:\n"
                  "   swarmcert study {} {} -o {}",
                  model, flights, output));
  fly(flights, models, common.force);
  residuals::InputArguments arguments;
  arguments.models = {model};
  arguments.flights = {flights};
  const residuals::Inputs inputs = residuals::read_inputs(arguments);
  Progress progress(common.quiet);
  const identification::Study study = identification::study(
      inputs, std::nullopt, common.jobs,
      [&](int done, int total, const std::string& what) { progress.show(done, total, what); });
  const residuals::ForceUnit unit = residuals::force_unit("", inputs.models);
  const StudyResult answer = study_result(study, unit, next_of_study(study, {}, inputs, output));
  const std::string sentence = headline(answer, unit);
  say("   " + sentence);
  result.headline = sentence;
  result.verdict = name(answer.found.judgement.verdict);
  const files::Json document = to_json(result_of("study", inputs.files(), std::nullopt, answer));
  return write_study_folder(answer, studied(study, inputs, true), {}, unit, document, output);
}

int run_demo(const DemoOptions& options, const CommonOptions& common) {
  const fs::path folder = options.output;
  refuse_to_replace(common, (folder / "cert.json").string());
  for (const char* const part : {"report", "flights", "study"})
    refuse_folder(common, (folder / part).string());
  fs::create_directories(folder);
  const Speaker say(common);
  files::NetworkArguments arguments;
  arguments.file = bundled_folder("networks", "nn/networks") + "/demo/network.toml";
  const files::Network network = files::load_network(arguments);
  DemoResult result;
  const std::string certify_page = certify_network(network, arguments.file, folder, common, say, result);
  const std::string study_page = study_flights(folder, common, say, result);
  say(fmt::format("Look at {} and {}.", certify_page, study_page));
  print_next(common, {"inspect", (folder / "flights" / "1" / "cf1_00").string()});
  write_result(common, result_of("demo", input_files(network), std::nullopt, result));
  return result.accepted ? kDone : kViolated;
}

}  // namespace

Command demo_command() {
  return {"demo", "Certify a bundled network, and find out what a model lacks from flights",
          "Certifies a network that ships with the tool and checks the certificate; then flies three short\n"
          "simulated flights with effects that a model lacks, finds them, and shows the error fall.\n\n"
          "Example: swarmcert demo",
          [](CLI::App& app) {
            const auto options = std::make_shared<DemoOptions>();
            add_output(app, "-o,--output", options->output, "Folder for the results")->capture_default_str();
            return [options](const CommonOptions& common) { return run_demo(*options, common); };
          },
          fields_of<DemoResult>()};
}

}  // namespace swarmcert::analysis
