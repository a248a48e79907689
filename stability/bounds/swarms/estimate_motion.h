/// @file Position, velocity and acceleration errors caused by estimation errors and a force error.
#pragma once

#include "stability/bounds/disturbance_bounds.h"
#include "stability/bounds/error_parts.h"
#include "stability/bounds/swarms/small_gain.h"

namespace swarmcert::stability {

/// Returns bounds on |e|, |e'| and |e''| in the long run under the velocity_error and the position_error of `errors`
/// together; its other members are ignored. With D = D(s) of the loop (axis_loop.h), without the delay's shift:
///   an error n of the velocity:  e = -Kd s/D n   = -Kd/D n',
///   an error n of the position:  e = -(Kp s + Ki)/D n,   e' = -(Kp s + Ki)/D n',
/// so |e'| and |e''| are at most sup|n| times the total variation of a kernel and of its slope, jumps included, or the
/// same with sup|n'| if that is smaller. A constant part of n causes no motion in the long run. |e| is that of
/// error_parts(). Infinite if neither sup|n| nor sup|n'| is known.
OwnMotion estimate_motion(const AxisLoop& loop, const OtherErrors& errors);

/// The same for a force error eps = f_a - f_hat of the class `force`, in the command channel: e = s/(m D) eps. Uses
/// sup|eps| (at most the total variation) or sup|eps'|, whichever gives less, and adds a constant force `bias_N`, which
/// displaces a vehicle without integral by |bias_N|/(m Kp). Infinite if neither is known.
OwnMotion force_motion(const AxisLoop& loop, const Disturbance& force, double bias_N);

}  // namespace swarmcert::stability
