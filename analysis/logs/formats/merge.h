/// @file Logs that lie in several files.
#pragma once

#include "analysis/logs/raw_log.h"

namespace swarmcert::logs {

/// Adds what `more` holds to `log`. Records of a topic that both have stand behind those of `log`; columns that only
/// one of them has are NaN in the other. Where texts of one name differ, those of `log` stay.
void append(RawLog& log, RawLog&& more);

}  // namespace swarmcert::logs
