/// @file Assigns columns to signals by evidence: the reading of all columns together under which physics holds best.
///
/// A reading of a file chooses for position, velocity and attitude a group of columns with unit, frame, order and
/// signs, or none. Its bits are the sum of the priors (readings.h) and of what must hold between them
/// (motion_evidence.h). The odds of a signal are the bits of the best reading of the file over those of the best one in
/// which this signal is another one. Less than kClear_bits: the signal is not used, and its possible meanings are
/// listed.
#pragma once

#include "analysis/logs/recognition.h"

namespace swarmcert::logs {

/// About 100 : 1.
inline constexpr double kClear_bits = 7;

/// Adds the signals that `found` lacks to it, from the columns of plain tables that it does not use. Without times
/// (only a header has been read) names decide.
void assign_by_evidence(const RawLog& log, Recognition& found);

}  // namespace swarmcert::logs
