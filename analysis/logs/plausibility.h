/// @file Numbers of a log that no flight has: signals in another unit, sensors that failed, impacts.
///
/// Every rule compares a log with physics or with itself, never with a model of the vehicle: at rest and in flight an
/// accelerometer feels 1 g in the mean, positions are the integral of velocities, attitudes that of rates.
#pragma once

#include <string>
#include <vector>

#include "analysis/logs/log.h"

namespace swarmcert::logs {

/// A reason not to trust a signal.
struct Doubt {
  std::string signal;          ///< "time", "position", "specific_force", "rate", "duty", "battery", "thrust"
  double value = 0;            ///< what was found, in the unit that `words` name
  std::string words;           ///< what is wrong and what was probably meant
  bool refuses_force = false;  ///< no force residual of this log means anything
};

/// What is implausible in `log`; empty for a log that can be trusted as far as it can be judged. Cost: a pass.
std::vector<Doubt> doubts_of(const Log& log);

}  // namespace swarmcert::logs
