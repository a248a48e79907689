/// @file Merges logs that are split over several files.
#pragma once

#include "analysis/logs/raw_log.h"

namespace swarmcert::logs {

/// Appends `more` to `log`. Records of a common topic are appended to those of `log`; columns that only one of the two
/// has are NaN in the other. If both have a text of the same name, that of `log` is kept.
void append(RawLog& log, RawLog&& more);

}  // namespace swarmcert::logs
