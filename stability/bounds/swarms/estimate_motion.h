/// @file How far errors of the estimates and a force error move a vehicle, its speed and acceleration included.
#pragma once

#include "stability/bounds/disturbance_bounds.h"
#include "stability/bounds/error_parts.h"
#include "stability/bounds/swarms/small_gain.h"

namespace swarmcert::stability {

/// sup |e|, |e'| and |e''| in the long run that the velocity_error and the position_error of `errors` cause together;
/// what else it holds is not read. With D = D(s) of the loop (axis_loop.h), without the delay's shift:
///   an error n of the velocity:  e = -Kd s/D n   = -Kd/D n',
///   an error n of the position:  e = -(Kp s + Ki)/D n,   e' = -(Kp s + Ki)/D n',
/// so |e'| and |e''| are at most sup|n| times the total variation of a kernel and of its slope, jumps included, or the
/// same for sup|n'| where that is less. A constant part of n moves nothing in the long run. |e| is that of
/// error_parts(). Infinite where neither sup|n| nor sup|n'| is known.
OwnMotion estimate_motion(const AxisLoop& loop, const OtherErrors& errors);

/// The same of a force error eps = f_a - f_hat of the class `force`, in the command channel: e = s/(m D) eps, by
/// sup|eps| (at most the total variation) or by sup|eps'|, whichever is less, and of a constant one of `bias_N`, which
/// moves a vehicle by |bias_N|/(m Kp) where no integral takes it over. Infinite where neither is known.
OwnMotion force_motion(const AxisLoop& loop, const Disturbance& force, double bias_N);

}  // namespace swarmcert::stability
