/// @file Figures that scripts draw in the page, from data that lie in the page as JSON.
#pragma once

#include <string>
#include <vector>

#include "analysis/report/report.h"

namespace swarmcert::analysis {

/// The data of a script as JSON that may stand inside an HTML script element; NaN becomes null.
std::string data_of(const std::vector<TimeSeries>& all, const std::string& unit);
std::string data_of(const std::vector<Replay>& flights, const std::string& unit);

/// A figure whose script finds an empty element `id` and its data in `id`-data.
std::string interactive(const std::string& id, const std::string& data, const std::string& caption);

}  // namespace swarmcert::analysis
