/// @file Mislabelled logs as JSON and as text.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/labels/mislabelled.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {

/// Appends the labels to `ranking` as mislabelled, which makes the verdict missing_effect. Prints them if `prints`.
/// @return whether there are any.
bool judge_labels(const std::vector<identification::Mislabelled>& labels, bool prints, files::Json& result);

/// Adds "mislabelled" of add, whose result has no ranking. Prints the labels if `prints`.
void add_labels(const std::vector<identification::Mislabelled>& labels, bool prints, files::Json& result);

/// Returns "Cf51 of swap/00 flew ..., all else was judged with the logs as they are: correct them first."
std::string sentence(const identification::Mislabelled& label);

}  // namespace swarmcert::analysis
