/// @file How far errors of the estimates move a vehicle, its speed and acceleration included.
#pragma once

#include "stability/bounds/error_parts.h"
#include "stability/bounds/small_gain.h"

namespace swarmcert::stability {

/// sup |e|, |e'| and |e''| in the long run that the velocity_error and the position_error of `errors` cause together;
/// what else it holds is not read. With D = D(s) of the loop (axis_loop.h), without the delay's shift:
///   an error n of the velocity:  e = -Kd s/D n   = -Kd/D n',
///   an error n of the position:  e = -(Kp s + Ki)/D n,   e' = -(Kp s + Ki)/D n',
/// so |e'| and |e''| are at most sup|n| times the total variation of a kernel and of its slope, jumps included, or the
/// same for sup|n'| where that is less. A constant part of n moves nothing in the long run. |e| is that of
/// error_parts(). Infinite where neither sup|n| nor sup|n'| is known.
OwnMotion estimate_motion(const AxisLoop& loop, const OtherErrors& errors);

}  // namespace swarmcert::stability
