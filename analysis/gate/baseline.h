/// @file The numbers of the last release, against which the next one is compared.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "analysis/gate/check.h"

namespace swarmcert::gate {

/// Values by name of the check. A baseline carries a hash of its content, so that no number changes unnoticed.
/// @param may_lack nothing, instead of an error, where the file does not exist.
/// @throws files::InputError if it cannot be read, is no baseline, or was edited.
std::unique_ptr<std::map<std::string, double>> read_baseline(const std::string& path, bool may_lack);

/// Replaces the file, atomically, by the numbers of `checks`; NaN and infinities are left out.
void write_baseline(const std::string& path, const Checks& checks);

}  // namespace swarmcert::gate
