/// @file Figures drawn by scripts in the page from data embedded as JSON.
#pragma once

#include <string>
#include <vector>

#include "analysis/report/report.h"

namespace swarmcert::analysis {

/// Returns the data of a script as JSON that is safe inside an HTML script element; NaN becomes null.
std::string data_of(const std::vector<TimeSeries>& all, const std::string& unit);
std::string data_of(const std::vector<Replay>& flights, const std::string& unit);

/// Returns a figure with an empty element `id` for its script and its data in `id`-data.
std::string interactive(const std::string& id, const std::string& data, const std::string& caption);

}  // namespace swarmcert::analysis
