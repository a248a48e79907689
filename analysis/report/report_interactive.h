/// @file Figures drawn by scripts in the page from data embedded as JSON.
#pragma once

#include <string>
#include <vector>

#include "analysis/report/report.h"

namespace swarmcert::analysis {

/// Returns the data of the scripts as JSON that is safe inside an HTML script element. A column is null if unknown, a
/// number if it has one value, else {low, high, data}: 16-bit steps between low and high, little endian, in base64;
/// -32768: unknown. The first column, the time, is 32-bit floats in base64.
std::string data_of(const Flown& flown);

/// Returns a figure with an empty element `id` for its script.
std::string interactive(const std::string& id, const std::string& caption);

}  // namespace swarmcert::analysis
