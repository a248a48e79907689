/// @file The report of `spacing`: the keep-out shape.
#pragma once

#include <string>

#include "analysis/report/table.h"
#include "nn/base/record.h"
#include "stability/bounds/swarms/spacing.h"

namespace swarmcert::analysis {

/// Writes FOLDER/report.html with the keep-out shape, the least crossing speeds, the `rows` of the shape and the
/// described `result`. Returns its path.
/// @throws files::InputError as Report::write().
std::string write_spacing_report(const stability::SpacingQuestion& question, const stability::Spacing& found,
                                 const Table& rows, const files::Node& result, const std::string& folder,
                                 bool overwrite);

}  // namespace swarmcert::analysis
