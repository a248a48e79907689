/// @file Detects values that no flight has: wrong units, failed sensors, impacts.
///
/// Each rule compares a log with physics or with itself, never with a model of the vehicle: at rest and in flight an
/// accelerometer measures 1 g on average, positions are the integral of velocities, attitudes that of rates.
#pragma once

#include <string>
#include <vector>

#include "analysis/logs/log.h"

namespace swarmcert::logs {

/// A reason not to trust a signal.
struct Doubt {
  std::string signal;          ///< "time", "position", "specific_force", "rate", "duty", "battery", "thrust"
  double value = 0;            ///< the value found, in the unit stated in `words`
  std::string words;           ///< what is wrong and what was probably meant
  bool refuses_force = false;  ///< no force residual of this log is meaningful
};

/// Returns what is implausible in `log`; empty if everything that can be judged is plausible. Cost: one pass.
std::vector<Doubt> doubts_of(const Log& log);

}  // namespace swarmcert::logs
