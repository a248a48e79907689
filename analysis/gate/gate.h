/// @file Judges a release: all checks of a policy, and one verdict.
#pragma once

#include <string>
#include <vector>

#include "analysis/gate/evidence.h"
#include "nn/base/input_error.h"

namespace swarmcert::gate {

struct GateResult {
  std::string policy;                ///< path as given
  std::string policy_in_repository;  ///< path from the root of its git repository; as given if it is in none
  Checks checks;                     ///< in order of the registry; one table may add several
  std::vector<std::string> not_run;  ///< checks that the policy does not request
  std::vector<EvidenceFile> files;   ///< existing files on which the release depends
  Conditions conditions;             ///< under which the release was judged
  std::vector<Change> changes;       ///< of the conditions since the baseline

  int count(Verdict verdict) const;
  bool has_bad_input() const;
  /// kPass if every check passes; kFail if one fails; otherwise kInconclusive.
  Verdict verdict() const;
};

/// Runs every check. A missing or damaged input fails the checks that need it. If no check needs it, it fails the
/// release in a row named "release"; so does a baseline that cannot be read, before any check runs. If there is a
/// baseline, the row "regression.limits" passes if no condition asks for less than it did there.
GateResult run_gate(const Policy& policy, const GateSettings& settings);

/// Returns the result for a policy that cannot be read: one row, named "policy", with bad input.
GateResult refused_policy(const std::string& policy, const files::InputError& error);

/// Returns 0 for pass, 3 for bad input, and 1 otherwise; 0 if all remaining checks are merely inconclusive and
/// `allow_inconclusive` is set.
int exit_code(const GateResult& result, bool allow_inconclusive);

}  // namespace swarmcert::gate
