/// @file Doubts about a log's numbers in results.
#pragma once

#include <string>
#include <vector>

#include "analysis/logs/plausibility.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {

/// [{signal, value, words, refused}]; empty where nothing is implausible.
files::Json json_of(const std::vector<logs::Doubt>& doubts);

/// Lines "PATH: WHAT: ..." of many logs for a reader: of those that say the same WHAT the first three in their order,
/// and then how many more there are. The JSON holds all of them.
std::vector<std::string> few_of_each(const std::vector<std::string>& lines);

}  // namespace swarmcert::analysis
