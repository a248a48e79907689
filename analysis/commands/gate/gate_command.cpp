#include <fmt/core.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>

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
  std::string policy, baseline, junit, sarif, markdown, bundle, key, report;
  bool update_baseline = false;
  bool github = false;
  bool allow_inconclusive = false;
  bool hashes = false;
};

struct GateRun {
  gate::GateResult result;
  bool updates_baseline = false;
};

void describe(files::Record& record, const GateRun& run) {
  describe(record, run.result);
  record.field("updates_baseline", run.updates_baseline, "Whether the baseline is replaced by these values.");
}

struct VerifyOptions {
  std::string folder, sha256, key;
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

/// Writes the result in every format that was asked for, and prints it.
void write_outputs(const gate::GateResult& result, const files::Node& record, const GateOptions& options,
                   const CommonOptions& common) {
  const bool allow = options.allow_inconclusive;
  if (!options.junit.empty()) files::write_file(options.junit, to_junit(result), common.force);
  if (!options.sarif.empty()) files::write_file(options.sarif, to_sarif(result, allow), common.force);
  if (!options.markdown.empty()) files::write_file(options.markdown, to_markdown(result), common.force);
  std::string report;
  if (!options.report.empty()) report = write_gate_report(result, record, options.report, common.force);
  write_result(common, record);
  if (common.prints_text()) fmt::print("{}", to_table(result));
  if (common.prints_text() && !report.empty()) fmt::print("report: {}\n", report);
  if (options.github) {
    fmt::print("{}", to_github(result, allow));
    append_summary(to_markdown(result));
  }
}

files::Node described(const gate::GateResult& result, const GateOptions& options) {
  std::vector<std::string> inputs;
  for (const gate::EvidenceFile& file : result.files) inputs.push_back(file.path);
  return result_of("gate", inputs, std::nullopt, GateRun{result, options.update_baseline});
}

void refuse_outputs(const GateOptions& options, const CommonOptions& common) {
  if (options.github && common.json == "-")
    throw UsageError("--github and --json - both print to standard output: give --json a file");
  if (options.update_baseline && options.baseline.empty())
    throw UsageError("--update-baseline replaces the file of --baseline: name it");
  if (!options.key.empty() && options.bundle.empty())
    throw UsageError("--key signs a bundle: name it with --bundle");
  for (const std::string& path : {common.json, options.junit, options.sarif, options.markdown})
    refuse_to_replace(common, path);
  refuse_folder(common, options.report);
  if (!options.bundle.empty() && std::filesystem::exists(options.bundle) && !common.force &&
      !(std::filesystem::is_directory(options.bundle) && std::filesystem::is_empty(options.bundle)))
    throw files::InputError({options.bundle, "", "", "", "the folder is not empty", "--force replaces it"});
}

/// Writes the bundle, then replaces the baseline: the bundle contains the one against which the release was checked.
void keep_release(const gate::Policy& policy, const gate::GateResult& result, const files::Node& record,
                  const GateOptions& options, const CommonOptions& common) {
  if (!options.bundle.empty()) {
    const bool may = result.verdict() == gate::Verdict::kPass;
    const std::string sha256 =
        may ? write_bundle(options.bundle, policy, result, to_json(record), options.key, common.force) : "";
    if (common.prints_text()) {
      if (may) fmt::print("bundle: {}\nSHA-256 of its statement: {}\n", options.bundle, sha256);
      if (!may) fmt::print("no bundle: the release does not pass\n");
    }
  }
  if (options.update_baseline) {
    const bool may = may_become_baseline(result);
    if (may) gate::write_baseline(options.baseline, result.checks, result.conditions);
    if (common.prints_text())
      fmt::print("baseline {}: {}\n", may ? "replaced" : "kept, for the release does not pass",
                 options.baseline);
  }
}

int run_gate(const GateOptions& options, const CommonOptions& common) {
  refuse_outputs(options, common);
  std::optional<gate::Policy> policy;
  try {
    policy = gate::read_policy(options.policy);
  } catch (const files::InputError& error) {
    if (options.hashes) throw;
    // Whoever reads the outputs learns about a broken policy from them.
    const gate::GateResult refused = gate::refused_policy(options.policy, error);
    write_outputs(refused, described(refused, options), options, common);
    throw;
  }
  if (options.hashes) {
    print_hashes(*policy);
    return kDone;
  }
  Progress progress(common.quiet);
  gate::GateSettings settings = settings_of(common, progress);
  settings.baseline = options.baseline;
  settings.may_lack_baseline = settings.updates_baseline = options.update_baseline;
  const gate::GateResult result = run_gate(*policy, settings);
  const files::Node record = described(result, options);
  write_outputs(result, record, options, common);
  keep_release(*policy, result, record, options, common);
  if (result.verdict() == gate::Verdict::kPass) {
    if (options.bundle.empty())
      print_next(common, {"gate", options.policy, "--bundle", "evidence"});
    else
      print_next(common, {"verify-bundle", options.bundle});
  }
  return exit_code(result, options.allow_inconclusive);
}

int verify(const VerifyOptions& options, const CommonOptions& common) {
  refuse_to_replace(common, common.json);
  Progress progress(common.quiet);
  gate::BundleVerdict verdict =
      gate::verify_bundle(options.folder, options.key, settings_of(common, progress));
  if (verdict.accepted && !options.sha256.empty() && verdict.statement_sha256 != options.sha256) {
    verdict.accepted = false;
    verdict.reason = "the statement's SHA-256 is " + verdict.statement_sha256 + ": this is another release";
  }
  write_result(common, result_of("verify-bundle", {}, std::nullopt, verdict));
  if (common.prints_text()) {
    for (const std::string& what : verdict.verified) fmt::print("  {}\n", what);
    for (const std::string& what : verdict.not_verified) fmt::print("  not verified: {}\n", what);
    if (verdict.accepted)
      fmt::print("accepted: {}\nSHA-256 of its statement: {}\n", options.folder, verdict.statement_sha256);
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
                       "Values and conditions of the last release: nothing may be asked for less than there");
        app.add_flag("--update-baseline", options->update_baseline,
                     "Replace the file of --baseline by this release's values and conditions, if all else "
                     "passes; conditions may be weaker");
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
                   "Copy all evidence of a release that passes into this folder, with an in-toto statement");
        leave_out_of_record(app.add_option("--key", options->key,
                                           "Private key (PEM) that signs the statement of the bundle"));
        app.add_flag("--hashes", options->hashes,
                     "Print a table [hashes] of the release's files for the policy, and check nothing");
        return [options](const CommonOptions& common) { return run_gate(*options, common); };
      },
      fields_of<GateRun>()};
}

Command verify_bundle_command() {
  return {"verify-bundle", "Verify a bundle that gate wrote, offline",
          "Exactly the files of the statement, with their hashes; then every row of the gate's result is "
          "derived again from\n"
          "these files, with the policy that the statement names. With --key, the statement must be signed "
          "by that key. Accepted:\n"
          "exit 0. Rejected, with the reason: exit 1.\n\n"
          "Example: swarmcert verify-bundle release/ --key public.pem",
          [](CLI::App& app) {
            const auto options = std::make_shared<VerifyOptions>();
            app.add_option("DIR", options->folder, "The bundle")->required();
            app.add_option("--key", options->key, "Public key (PEM) that must have signed the statement");
            app.add_option("--sha256", options->sha256,
                           "Expected SHA-256 of the statement, as printed by gate");
            app.add_flag("--rerun", "Accepted for older scripts: all checks always run again");
            return [options](const CommonOptions& common) { return verify(*options, common); };
          },
          fields_of<gate::BundleVerdict>()};
}

}  // namespace swarmcert::analysis
