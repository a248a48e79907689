/// @file The report of `certify`: bounds, norms, slope maps and inputs, with plots.
#pragma once

#include <string>

#include "analysis/commands/certify/certify_output.h"

namespace swarmcert::analysis {

/// Writes FOLDER/report.html and its plots, and returns the path of report.html. The numbers carry the guarantees of
/// `output`; the page embeds the JSON `result`.
/// @throws files::InputError if the folder is not empty and `overwrite` is false.
std::string write_certify_report(const files::Network& network, const CertifyOutput& output,
                                 const files::Node& result, const std::string& folder, bool overwrite);

}  // namespace swarmcert::analysis
