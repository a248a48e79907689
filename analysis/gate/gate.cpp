#include "analysis/gate/gate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "analysis/gate/baseline.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"

namespace swarmcert::gate {
namespace {

/// Adds the rows of `check`, or a row that states why there are none.
void run(const PlannedCheck& check, Evidence& evidence, Checks& checks) {
  const std::size_t before = checks.size();
  const auto give_up = [&](const std::string& reason, bool is_bad_input) {
    checks.resize(before);
    Check failed = row(check.name, check.line);
    fail(failed, reason);
    failed.is_bad_input = is_bad_input;
    failed.stands_for_table = true;
    checks.push_back(std::move(failed));
  };
  try {
    check.run(evidence, checks);
  } catch (const files::InputError& error) {
    give_up(error.what(), true);
  } catch (const std::filesystem::filesystem_error& error) {
    give_up(error.path1().string() + ": " + error.code().message(), true);
  } catch (const std::invalid_argument& error) {
    give_up(error.what(), true);
  } catch (const Unfounded& error) {
    give_up(error.what(), false);
  }
}

/// Checks that no limit is looser than in the baseline and that none of its checks is missing, unless this release
/// becomes the baseline.
void judge_limits(const Policy& policy, const Baseline& baseline, bool updates_baseline, Checks& checks) {
  Check check = row("regression.limits", policy.release_line);
  for (const PlannedCheck& planned : policy.checks)
    if (planned.name == "regression") check.line = planned.line;
  const std::vector<std::string> all = loosened(baseline, checks, policy.regression);
  const std::string words = fmt::format("{}", fmt::join(all, "; "));
  if (all.empty()) {
    pass(check);
    check.witness = "no limit is looser than the baseline's, no check was dropped";
  } else if (updates_baseline) {
    pass(check);
    check.witness = "accepted by --update-baseline: " + words;
  } else {
    fail(check,
         "the policy asks for less than the baseline's: " + words + ". --update-baseline accepts that");
  }
  checks.push_back(std::move(check));
}

/// Checks that every file can be read, whether a check needs it or not.
void judge_files(const std::vector<EvidenceFile>& files, int line, Checks& checks) {
  for (const EvidenceFile& file : files) {
    try {
      files::sha256_of_file(file.path);
    } catch (const files::InputError& error) {
      const std::string reason = error.what();
      const auto says_so = [&](const Check& check) {
        return check.reason.find(file.path) != std::string::npos;
      };
      if (std::any_of(checks.begin(), checks.end(), says_so)) continue;
      Check failed = row("release", line);
      fail(failed, reason);
      failed.is_bad_input = true;
      checks.push_back(std::move(failed));
    }
  }
}

}  // namespace

int GateResult::count(Verdict of) const {
  return static_cast<int>(
      std::count_if(checks.begin(), checks.end(), [of](const Check& check) { return check.verdict == of; }));
}

bool GateResult::has_bad_input() const {
  return std::any_of(checks.begin(), checks.end(), [](const Check& check) { return check.is_bad_input; });
}

Verdict GateResult::verdict() const {
  if (count(Verdict::kFail) > 0) return Verdict::kFail;
  return count(Verdict::kInconclusive) > 0 || checks.empty() ? Verdict::kInconclusive : Verdict::kPass;
}

GateResult run_gate(const Policy& policy, const GateSettings& settings) {
  GateResult result;
  result.policy = policy.path;
  result.not_run = policy.not_run;
  Evidence evidence(policy, settings);
  int done = 0;
  for (const PlannedCheck& check : policy.checks) {
    if (settings.progress) settings.progress(done++, static_cast<int>(policy.checks.size()), check.name);
    run(check, evidence, result.checks);
  }
  result.files = evidence_files(policy, settings.baseline);
  judge_files(result.files, policy.release_line, result.checks);
  result.files.erase(std::remove_if(result.files.begin(), result.files.end(),
                                    [](const EvidenceFile& file) {
                                      std::error_code ignored;
                                      return !std::filesystem::is_regular_file(file.path, ignored);
                                    }),
                     result.files.end());
  try {
    if (const Baseline* const baseline = evidence.baseline()) {
      for (Check& check : result.checks) {
        const auto found = baseline->values.find(check.name);
        if (found != baseline->values.end()) check.baseline = found->second;
      }
      judge_limits(policy, *baseline, settings.updates_baseline, result.checks);
    }
  } catch (const files::InputError& error) {
    // A baseline that was given but cannot be read fails the release, whether or not regressions are judged.
    const auto says_so = [&](const Check& check) { return check.reason == error.what(); };
    if (std::none_of(result.checks.begin(), result.checks.end(), says_so)) {
      Check failed = row("release", policy.release_line);
      fail(failed, error.what());
      failed.is_bad_input = true;
      result.checks.push_back(std::move(failed));
    }
  }
  return result;
}

int exit_code(const GateResult& result, bool allow_inconclusive) {
  if (result.has_bad_input()) return 3;
  if (result.verdict() == Verdict::kPass) return 0;
  return result.verdict() == Verdict::kInconclusive && allow_inconclusive ? 0 : 1;
}

}  // namespace swarmcert::gate
