#include <fmt/core.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>

#include "analysis/cli/command_line.h"
#include "analysis/cli/progress.h"
#include "analysis/commands/commands.h"
#include "analysis/commands/gate/gate_report.h"
#include "analysis/gate/baseline.h"
#include "analysis/gate/bundle.h"
#include "analysis/gate/gate.h"
#include "analysis/gate/outputs.h"
#include "analysis/gate/text.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"

namespace swarmcert::analysis {
namespace {

struct GateOptions {
  std::string policy, baseline, junit, sarif, markdown, bundle, report;
  bool update_baseline = false;
  bool github = false;
  bool allow_inconclusive = false;
  bool hashes = false;
};

struct VerifyOptions {
  std::string folder, sha256;
  bool rerun = false;
};

gate::GateSettings settings_of(const CommonOptions& common, Progress& progress) {
  gate::GateSettings settings;
  settings.jobs = common.jobs;
  settings.progress = [&progress](int done, int total, const std::string& what) {
    progress.show(done, total, what);
  };
  return settings;
}

/// Appends to the summary, as GitHub requires, because several steps share the file.
void append_summary(const std::string& markdown) {
  const char* const path = std::getenv("GITHUB_STEP_SUMMARY");
  if (path == nullptr || *path == '\0') return;
  std::ofstream file(path, std::ios::app | std::ios::binary);
  file << markdown << '\n';
  file.flush();
  if (!file) throw files::InputError({path, "", "GITHUB_STEP_SUMMARY", "", "cannot be written", ""});
}

/// Prints a table [hashes] of all files on which the release depends, to be pasted into the policy.
void print_hashes(const gate::Policy& policy) {
  const std::filesystem::path folder = std::filesystem::absolute(policy.path).parent_path();
  fmt::print("[hashes]\n");
  for (const gate::EvidenceFile& file : gate::evidence_files(policy, "")) {
    if (file.role == "policy") continue;
    const std::string relative = std::filesystem::absolute(file.path)
                                     .lexically_normal()
                                     .lexically_relative(folder.lexically_normal())
                                     .string();
    fmt::print("{} = \"{}\"  # {}\n", files::Json(relative).dump(), files::sha256_of_file(file.path),
               file.role);
  }
}

/// Whether every check except `regression` passes, so that the release may become the next baseline.
bool may_become_baseline(const gate::GateResult& result) {
  for (const gate::Check& check : result.checks)
    if (check.name.rfind("regression", 0) != 0 && check.verdict != gate::Verdict::kPass) return false;
  return true;
}

int run_gate(const GateOptions& options, const CommonOptions& common) {
  if (options.github && common.json == "-")
    throw UsageError("--github and --json - both print to standard output: give --json a file");
  if (options.update_baseline && options.baseline.empty())
    throw UsageError("--update-baseline replaces the file of --baseline: name it");
  for (const std::string& path : {common.json, options.junit, options.sarif, options.markdown})
    refuse_to_replace(common, path);
  refuse_folder(common, options.report);
  if (!options.bundle.empty() && std::filesystem::exists(options.bundle) && !common.force &&
      !(std::filesystem::is_directory(options.bundle) && std::filesystem::is_empty(options.bundle)))
    throw files::InputError({options.bundle, "", "", "", "the folder is not empty", "--force replaces it"});
  const gate::Policy policy = gate::read_policy(options.policy);
  if (options.hashes) {
    print_hashes(policy);
    return kDone;
  }
  Progress progress(common.quiet);
  gate::GateSettings settings = settings_of(common, progress);
  settings.baseline = options.baseline;
  settings.may_lack_baseline = settings.updates_baseline = options.update_baseline;
  const gate::GateResult result = run_gate(policy, settings);

  std::vector<std::string> inputs;
  for (const gate::EvidenceFile& file : result.files) inputs.push_back(file.path);
  files::Json json = result_head("gate", inputs);
  add_json(result, json);
  json["updates_baseline"] = options.update_baseline;
  const bool allow = options.allow_inconclusive;
  if (!options.junit.empty()) files::write_file(options.junit, to_junit(result), common.force);
  if (!options.sarif.empty()) files::write_file(options.sarif, to_sarif(result, allow), common.force);
  if (!options.markdown.empty()) files::write_file(options.markdown, to_markdown(result), common.force);
  std::string report;
  if (!options.report.empty()) report = write_gate_report(result, json, options.report, common.force);
  write_result(common, json);
  if (common.prints_text()) fmt::print("{}", to_table(result));
  if (common.prints_text() && !report.empty()) fmt::print("report: {}\n", report);
  if (options.github) {
    fmt::print("{}", to_github(result, allow));
    append_summary(to_markdown(result));
  }
  // The bundle is written before the baseline is replaced: it contains the baseline against which the release was
  // checked.
  if (!options.bundle.empty()) {
    const bool may = result.verdict() == gate::Verdict::kPass;
    const std::string sha256 = may ? write_bundle(options.bundle, policy, result, json, common.force) : "";
    if (common.prints_text()) {
      if (may) fmt::print("bundle: {}\nSHA-256 of its manifest: {}\n", options.bundle, sha256);
      if (!may) fmt::print("no bundle: the release does not pass\n");
    }
  }
  if (options.update_baseline) {
    const bool may = may_become_baseline(result);
    if (may) gate::write_baseline(options.baseline, result.checks, policy.regression);
    if (common.prints_text())
      fmt::print("baseline {}: {}\n", may ? "replaced" : "kept, for the release does not pass",
                 options.baseline);
  }
  return exit_code(result, allow);
}

int verify(const VerifyOptions& options, const CommonOptions& common) {
  refuse_to_replace(common, common.json);
  Progress progress(common.quiet);
  gate::BundleVerdict verdict =
      gate::verify_bundle(options.folder, options.rerun, settings_of(common, progress));
  if (verdict.accepted && !options.sha256.empty() && verdict.manifest_sha256 != options.sha256) {
    verdict.accepted = false;
    verdict.reason = "the manifest's SHA-256 is " + verdict.manifest_sha256 + ": this is another release";
  }
  files::Json json = result_head("verify-bundle", {});
  json["accepted"] = verdict.accepted;
  json["reason"] = gate::printable(verdict.reason);
  json["manifest_sha256"] = verdict.manifest_sha256;
  json["files"] = verdict.files;
  json["verified"] = verdict.verified;
  write_result(common, json);
  if (common.prints_text()) {
    for (const std::string& what : verdict.verified) fmt::print("  {}\n", what);
    if (verdict.accepted)
      fmt::print("accepted: {}\nSHA-256 of its manifest: {}\n", options.folder, verdict.manifest_sha256);
    if (!verdict.accepted) fmt::print("rejected: {}\n", gate::printable(verdict.reason));
  }
  return verdict.accepted ? kDone : kViolated;
}

}  // namespace

Command gate_command() {
  return {
      "gate", "Check a release against a policy: may it ship?",
      "POLICY.toml names the files of the release and has one table per check with its limits. Every check "
      "passes, fails\n"
      "with a witness, or is inconclusive; checks that the policy does not request are listed. Exit code 0 "
      "if all pass, 3 for\n"
      "a file that is missing or damaged, else 1. Paths in a policy are relative to it.\n\n"
      "Example: swarmcert gate policy.toml --baseline baseline.json --junit gate.xml",
      [](CLI::App& app) {
        const auto options = std::make_shared<GateOptions>();
        app.add_option("POLICY", options->policy, "policy.toml (schema swarmcert/policy/1)")->required();
        app.add_option("--baseline", options->baseline,
                       "Numbers of the last release, for the check regression");
        app.add_flag("--update-baseline", options->update_baseline,
                     "Replace the file of --baseline by this release's numbers and limits, if all else "
                     "passes; limits may be looser and checks fewer");
        app.add_flag("--allow-inconclusive", options->allow_inconclusive,
                     "Checks that are inconclusive do not fail");
        add_output(app, "--junit", options->junit, "Write JUnit XML to this file");
        add_output(app, "--sarif", options->sarif, "Write SARIF 2.1.0 to this file");
        add_output(app, "--markdown", options->markdown, "Write a Markdown table to this file");
        add_output(app, "--report", options->report, "Write an HTML report into this folder");
        leave_out_of_record(
            app.add_flag("--github", options->github,
                         "Print GitHub annotations, and append to the step summary ($GITHUB_STEP_SUMMARY)"));
        add_output(app, "--bundle", options->bundle,
                   "Copy all evidence of a release that passes into this folder, with a manifest of hashes");
        app.add_flag("--hashes", options->hashes,
                     "Print a table [hashes] of the release's files for the policy, and check nothing");
        return [options](const CommonOptions& common) { return run_gate(*options, common); };
      }};
}

Command verify_bundle_command() {
  return {"verify-bundle", "Verify a bundle that gate wrote, offline",
          "Exactly the files of the manifest, with their hashes; the gate's result; then the independent "
          "checker on the\n"
          "bundle's certificate and weights, and the match of its source and ELF. Accepted: exit 0. "
          "Rejected, with the reason: exit 1.\n\n"
          "Example: swarmcert verify-bundle release/ --rerun",
          [](CLI::App& app) {
            const auto options = std::make_shared<VerifyOptions>();
            app.add_option("DIR", options->folder, "The bundle")->required();
            app.add_flag("--rerun", options->rerun, "Also run every check of the policy again");
            app.add_option("--sha256", options->sha256,
                           "Expected SHA-256 of the manifest, as printed by gate");
            return [options](const CommonOptions& common) { return verify(*options, common); };
          }};
}

}  // namespace swarmcert::analysis
