/// @file The gate's result as a page: how much of every limit is used, and the evidence of a failure.
#pragma once

#include <string>

#include "analysis/gate/gate.h"
#include "nn/base/record.h"

namespace swarmcert::analysis {

/// Writes FOLDER/report.html: verdict, bars of value over limit, the checks, the files with their SHA-256.
/// @param record what --json writes
/// @returns the path of report.html.
/// @throws files::InputError as Report::write().
std::string write_gate_report(const gate::GateResult& result, const files::Node& record,
                              const std::string& folder, bool overwrite);

}  // namespace swarmcert::analysis
