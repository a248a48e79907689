/// @file The numbers and limits of the last release, against which the next one is compared.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "analysis/gate/check.h"

namespace swarmcert::gate {

struct BaselineLimit {
  double value = 0;
  bool is_most = true;  ///< the value may be at most this; else at least
};

struct Baseline {
  std::map<std::string, double> values;                        ///< by name of the row
  std::map<std::string, std::optional<BaselineLimit>> checks;  ///< every row, with the limit where it had one
  RegressionLimits regression;                                 ///< of the policy's table [regression]
};

/// What the policy of `baseline` asked for and this release's does not, in words: limits that were loosened, checks and
/// limits that were dropped.
std::vector<std::string> loosened(const Baseline& baseline, const Checks& checks,
                                  const RegressionLimits& regression);

/// The baseline in a file. A baseline carries a hash of its content, so that no number changes unnoticed.
/// @param may_lack nothing, instead of an error, where the file does not exist.
/// @throws files::InputError if it cannot be read, is no baseline, or was edited.
std::unique_ptr<Baseline> read_baseline(const std::string& path, bool may_lack);

/// Replaces the file, atomically, by the numbers and limits of `checks`; NaN and infinities are left out.
void write_baseline(const std::string& path, const Checks& checks, const RegressionLimits& regression = {});

}  // namespace swarmcert::gate
