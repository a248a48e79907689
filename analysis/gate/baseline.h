/// @file The values and limits of the last release, with which the next release is compared.
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
  bool is_most = true;  ///< the value may be at most this; otherwise at least
};

struct Baseline {
  std::map<std::string, double> values;                        ///< by row name
  std::map<std::string, std::optional<BaselineLimit>> checks;  ///< every row, with its limit if it has one
  RegressionLimits regression;                                 ///< from the policy's table [regression]
};

/// Describes what the policy of `baseline` requires and the policy of this release does not: loosened limits, and
/// dropped checks and limits.
std::vector<std::string> loosened(const Baseline& baseline, const Checks& checks,
                                  const RegressionLimits& regression);

/// Reads a baseline file. A baseline carries a hash of its content, so that no number changes unnoticed.
/// @param may_lack return nullptr instead of an error if the file does not exist.
/// @throws files::InputError if the file cannot be read, is not a baseline, or was edited.
std::unique_ptr<Baseline> read_baseline(const std::string& path, bool may_lack);

/// Atomically replaces the file by the values and limits of `checks`; NaN and infinities are left out.
void write_baseline(const std::string& path, const Checks& checks, const RegressionLimits& regression = {});

}  // namespace swarmcert::gate
