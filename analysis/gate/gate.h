/// @file Judging a release: every check of a policy, and one verdict.
#pragma once

#include <string>
#include <vector>

#include "analysis/gate/evidence.h"

namespace swarmcert::gate {

struct GateResult {
  std::string policy;                ///< path as given
  Checks checks;                     ///< in order of the registry; one table may have several
  std::vector<std::string> not_run;  ///< what the policy does not ask for
  std::vector<EvidenceFile> files;   ///< that the release rests on and that exist

  int count(Verdict verdict) const;
  bool has_bad_input() const;
  /// Pass: every check passes. Fail: one fails. Else inconclusive.
  Verdict verdict() const;
};

/// Runs every check. An input that is missing or damaged fails the checks that need it, and the release where no check
/// does: the row "release" names it.
GateResult run_gate(const Policy& policy, const GateSettings& settings);

/// 0 pass; 3 bad input; 1 otherwise, and 0 instead where all that is wrong is inconclusive and allowed.
int exit_code(const GateResult& result, bool allow_inconclusive);

}  // namespace swarmcert::gate
