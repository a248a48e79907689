/// @file Mislabelled logs as results and as text.
#pragma once

#include <string>
#include <vector>

#include "analysis/commands/shared/ranking.h"
#include "analysis/identification/labels/mislabelled.h"

namespace swarmcert::analysis {

/// Returns the labels as entries `mislabelled`.
std::vector<Ranked> ranked(const std::vector<identification::Mislabelled>& labels);

/// Describes an entry of `mislabelled` of add, whose result has no ranking.
void describe_label(files::Record& record, const identification::Mislabelled& label);

void print_mislabelled(const std::vector<identification::Mislabelled>& labels);

/// Returns "Cf51 of swap/00 flew ..., all else was judged with the logs as they are: correct them first."
std::string sentence(const identification::Mislabelled& label);

}  // namespace swarmcert::analysis
