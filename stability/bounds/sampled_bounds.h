/// @file Bounds on the tracking error of a sampled loop, from its own kernel: what disturbance_bounds.h does for a
/// continuous one.
#pragma once

#include "stability/bounds/disturbance_bounds.h"
#include "stability/bounds/loops/sampled_loop.h"

namespace swarmcert::stability {

/// B1..B5 of the sampled loop, at and between its samples; kCommand is an error added to the command once per period.
/// The kernel is a polynomial on each period, so passes are felt as its maxima say, and B5 is split_bound() of it, on
/// five phases of the period, of which the worst counts.
/// @param gains sampled_norms(loop, channel, Instants::kAll).
DisturbanceBounds disturbance_bounds(const SampledLoop& loop, Channel channel, const GainNorms& gains,
                                     const Disturbance& disturbance);

/// What a clamp of the integrator's state does. The demand is the exact gain to that state; the bounds that hold with
/// an acting clamp are those of the loop without integral, to which the integral is an error of its command.
/// @param limit_m_s on the state I that firmware keeps (it adds integrator_step_s e per period).
ClampBounds clamp_bounds(const SampledLoop& loop, Channel channel, const Disturbance& disturbance,
                         const OtherErrors& other, double limit_m_s);

}  // namespace swarmcert::stability
