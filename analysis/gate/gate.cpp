#include "analysis/gate/gate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "analysis/gate/baseline.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"

namespace swarmcert::gate {
namespace {

Check bad_input(const std::string& name, int line, const std::string& reason) {
  Check failed = row(name, line);
  fail(failed, reason);
  failed.is_bad_input = true;
  return failed;
}

/// Adds the rows of `check`, or a row that states why there are none.
void run(const PlannedCheck& check, Evidence& evidence, Checks& checks) {
  const std::size_t before = checks.size();
  const auto give_up = [&](const std::string& reason, bool is_bad_input) {
    checks.resize(before);
    checks.push_back(bad_input(check.name, check.line, reason));
    checks.back().is_bad_input = is_bad_input;
    checks.back().stands_for_table = true;
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

/// Checks that no condition asks for less than in the baseline, unless this release becomes the baseline.
Check judge_conditions(const Policy& policy, const std::vector<Change>& changes, bool updates_baseline) {
  Check check = row("regression.limits", policy.release_line);
  for (const PlannedCheck& planned : policy.checks)
    if (planned.name == "regression") check.line = planned.line;
  std::string less, more;
  for (const Change& change : changes) {
    std::string& list = change.asks_for_less() ? less : more;
    list += (list.empty() ? "" : "; ") + words(change);
    if (change.claim == Change::Claim::kOpen) list += " (not known to be stronger)";
  }
  const std::string others = more.empty() ? "" : "; also changed: " + more;
  if (less.empty()) {
    pass(check);
    check.witness = "nothing is asked for less than in the baseline" + others;
  } else if (updates_baseline) {
    pass(check);
    check.witness = "accepted by --update-baseline: " + less + others;
  } else {
    fail(check, "less is asked for than in the baseline: " + less + ". --update-baseline accepts that");
    check.witness = more;
  }
  return check;
}

/// Code scanning shows places by their path from the root of the repository.
std::string path_in_repository(const std::string& path) {
  namespace fs = std::filesystem;
  const fs::path whole = fs::absolute(path).lexically_normal();
  for (fs::path folder = whole.parent_path();; folder = folder.parent_path()) {
    std::error_code ignored;
    if (fs::exists(folder / ".git", ignored)) return whole.lexically_relative(folder).generic_string();
    if (!folder.has_relative_path()) return path;
  }
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
      checks.push_back(bad_input("release", line, reason));
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
  result.policy_in_repository = path_in_repository(policy.path);
  result.not_run = policy.not_run;
  Evidence evidence(policy, settings);
  const Baseline* baseline = nullptr;
  try {
    baseline = evidence.baseline();
  } catch (const files::InputError& error) {
    result.checks.push_back(bad_input("release", policy.release_line, error.what()));
    return result;
  }
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
  result.conditions = conditions_of(evidence);
  if (baseline == nullptr) return result;
  for (Check& check : result.checks) {
    const auto found = baseline->values.find(check.name);
    if (found != baseline->values.end()) check.baseline = found->second;
  }
  result.changes = changes(baseline->conditions, result.conditions);
  result.checks.push_back(judge_conditions(policy, result.changes, settings.updates_baseline));
  return result;
}

GateResult refused_policy(const std::string& policy, const files::InputError& error) {
  GateResult result;
  result.policy = policy;
  result.policy_in_repository = path_in_repository(policy);
  int line = 1;
  std::sscanf(error.fault().where.c_str(), "line %d", &line);
  result.checks.push_back(bad_input("policy", line, error.what()));
  return result;
}

int exit_code(const GateResult& result, bool allow_inconclusive) {
  if (result.has_bad_input()) return 3;
  if (result.verdict() == Verdict::kPass) return 0;
  return result.verdict() == Verdict::kInconclusive && allow_inconclusive ? 0 : 1;
}

}  // namespace swarmcert::gate
