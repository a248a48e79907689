/// @file Implausible values of a log in results.
#pragma once

#include <string>
#include <vector>

#include "analysis/logs/plausibility.h"
#include "nn/base/record.h"

namespace swarmcert::analysis {

/// Shortens lines "PATH: WHAT: ..." of many logs for display: of the lines with the same WHAT it keeps the first
/// three in their order and adds how many more there are. The JSON result contains all of them.
std::vector<std::string> few_of_each(const std::vector<std::string>& lines);

}  // namespace swarmcert::analysis

namespace swarmcert::logs {

void describe(files::Record& record, const Doubt& doubt);

}  // namespace swarmcert::logs
