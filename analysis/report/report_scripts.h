/// @file What a report's page needs, embedded at build time.
#pragma once

#include <string_view>

namespace swarmcert::analysis {

extern const std::string_view kPageScript;
extern const std::string_view kPageStyle;

/// dygraphs and this project's script behind it; empty where the build found no dygraphs (package libjs-dygraphs).
extern const std::string_view kTimeSeriesScript;
extern const std::string_view kTimeSeriesStyle;

/// three.js, its orbit controls and this project's script behind them; empty where the build found none (libjs-three).
extern const std::string_view kReplayScript;

}  // namespace swarmcert::analysis
