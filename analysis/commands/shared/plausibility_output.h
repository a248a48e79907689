/// @file Doubts about a log's numbers in results.
#pragma once

#include <vector>

#include "analysis/logs/plausibility.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {

/// [{signal, value, words, refused}]; empty where nothing is implausible.
files::Json json_of(const std::vector<logs::Doubt>& doubts);

}  // namespace swarmcert::analysis
