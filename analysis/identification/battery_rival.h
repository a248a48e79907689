/// @file Whether flights can distinguish thrust that falls with the battery from thrust that falls with time.
#pragma once

#include <vector>

#include "analysis/identification/missing.h"

namespace swarmcert::identification {

/// Adds thrust that changes linearly with the time of a flight as a rival of a battery in `ranking`, if it explains at
/// least half as much as the battery and the flights do not clearly prefer the battery: in held-out blocks of 2 s the
/// battery's errors are not smaller by two standard errors.
void name_time_beside_battery(const Passes& passes, std::vector<Missing>& ranking);

/// The name of that rival.
inline constexpr char kThrustOverTime[] = "formula_thrust_over_time";

}  // namespace swarmcert::identification
