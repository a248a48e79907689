/// @file The report of `spacing`: the keep-out shape.
#pragma once

#include <string>

#include "nn/base/json.h"
#include "stability/bounds/swarms/spacing.h"

namespace swarmcert::analysis {

/// Writes FOLDER/report.html with the keep-out shape, the least crossing speeds and the JSON `result`. Returns its
/// path.
/// @throws files::InputError as Report::write().
std::string write_spacing_report(const stability::SpacingQuestion& question, const stability::Spacing& found,
                                 const files::Json& result, const std::string& folder, bool overwrite);

}  // namespace swarmcert::analysis
