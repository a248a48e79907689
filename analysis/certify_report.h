/// @file The report of `certify`: bounds, norms and inputs, with a plot.
#pragma once

#include <string>

#include "lipschitz/certify.h"
#include "nn/files/network.h"

namespace swarmcert::analysis {

/// Writes FOLDER/report.html and its plot; returns the path of report.html. The numbers carry the guarantees that
/// `found` has.
/// @throws files::InputError if the folder is not empty and `overwrite` is false.
std::string write_certify_report(const files::Network& network, const lipschitz::Certification& found,
                                 lipschitz::Verdict verdict, const std::string& folder, bool overwrite);

}  // namespace swarmcert::analysis
