/// @file Bounds on the tracking error of a sampled loop, from its own kernel; the counterpart of
/// disturbance_bounds.h for sampled loops.
#pragma once

#include "stability/bounds/disturbance_bounds.h"
#include "stability/bounds/loops/sampled_loop.h"

namespace swarmcert::stability {

/// Returns B1..B5 of the sampled loop, at and between its samples; kCommand is an error added to the command once per
/// period. The kernel is a polynomial on each period. The effect of earlier passes is bounded by the maxima of these
/// polynomials, and B5 is the worst split_bound() over five phases of the period.
/// @param gains sampled_norms(loop, channel, Instants::kAll).
DisturbanceBounds disturbance_bounds(const SampledLoop& loop, Channel channel, const GainNorms& gains,
                                     const Disturbance& disturbance);

/// Returns sup |u| of the commanded force due to a force error, N; for kCommand including the error itself.
double effort_of_class_N(const SampledLoop& loop, Channel channel, const Disturbance& disturbance);

/// Returns |u| that a force within the amplitude attains with the clamp, N: the worst force of the linear loop, and
/// that of the loop without integral, held over each period and simulated from rest. 0 if the loop is unstable.
double effort_of_worst_force_N(const SampledLoop& loop, double amplitude_N, double limit_m_s);

/// Returns the demand on the integrator's state, and whether its clamp may act: clamp_bounds() without bounds.
ClampBounds clamp_demand(const SampledLoop& loop, Channel channel, const Disturbance& disturbance,
                         const OtherErrors& other, double limit_m_s);

/// Returns the effect of a clamp on the integrator's state. The demand is the exact gain to that state. The bounds that
/// hold while the clamp acts are those of the loop without integral, with the integral as an error of its command.
/// @param limit_m_s on the state I that firmware keeps (it adds integrator_step_s e per period).
ClampBounds clamp_bounds(const SampledLoop& loop, Channel channel, const Disturbance& disturbance,
                         const OtherErrors& other, double limit_m_s);

}  // namespace swarmcert::stability
