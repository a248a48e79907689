/// @file Scripts and styles of report pages, embedded at build time.
#pragma once

#include <string_view>

namespace swarmcert::analysis {

extern const std::string_view kPageScript;
extern const std::string_view kPageStyle;

/// dygraphs followed by this project's script; empty if the build found no dygraphs (package libjs-dygraphs).
extern const std::string_view kTimeSeriesScript;
extern const std::string_view kTimeSeriesStyle;

/// three.js and its orbit controls, followed by this project's script; empty if the build found none (libjs-three).
extern const std::string_view kReplayScript;

}  // namespace swarmcert::analysis
