/// @file What it costs that the thrust ratio is known only within an interval.
#pragma once

#include "stability/bounds/disturbance_bounds.h"
#include "stability/bounds/error_parts.h"
#include "stability/bounds/loops/sampled_loop.h"

namespace swarmcert::stability {

/// The force that acts is (1 + d) times the one of the model, with a constant |d| <= R < 1 that nobody knows:
///   m e'' = (1 + d) u + d w0 + f,
/// u the feedback's part of the force that acts, w0 the force commanded at hover (the weight on z), f all others.
///
/// The class of f. (1 + d) u is the loop with gains scaled by 1 + d, so the gains of a class are the largest over that
/// interval (uncertain_norms.h). Several passes count as so many single ones, amplitude and rate together as the lesser
/// of both.
///
/// The rest. d w0 is a constant force. d u counts as a force on the loop of the model: with U = sup |u| there and E the
/// gain from a force to u, |d u| <= R U / (1 - R E) (small gain), and infinite where R E >= 1.
///
/// What a network feeds forward passes the ratio too; d f_hat belongs to f.
struct ThrustRatioGains {
  GainNorms of_class;      ///< largest over the interval, of the channel by which f enters
  double force_per_N = 0;  ///< R / (1 - R E)
  double amplitude = 0;    ///< m/N, of a force on the loop of the model
  double edge = 0;         ///< m/N, of a constant force
};
ThrustRatioGains thrust_ratio_gains(const AxisLoop& loop, Channel channel, double ratio_error);
ThrustRatioGains thrust_ratio_gains(const SampledLoop& loop, Channel channel, double ratio_error);

/// Bounds of the class alone with these gains.
DisturbanceBounds disturbance_bounds(const ThrustRatioGains& gains, const Disturbance& disturbance);

/// What the ratio adds to the bound of any class, m.
/// @param errors with thrust_ratio_error and hover_N. @param errors_N effort_N() of them, hover's share included.
double thrust_ratio_part(const ThrustRatioGains& gains, const OtherErrors& errors, double errors_N);

/// What a clamp of the integrator does then. The demand grows by what d w0 and d u ask of the integrator; the bounds
/// with an acting clamp are those of the loop without integral, over the interval of the ratio, which the integral's
/// command passes too.
/// @param exact what clamp_bounds() says of the loop of the model. @param of_class the gains of the whole loop.
ClampBounds clamp_bounds(const AxisLoop& loop, Channel channel, const ClampBounds& exact,
                         const ThrustRatioGains& of_class, const Disturbance& known,
                         const OtherErrors& errors, double limit_m_s);
ClampBounds clamp_bounds(const SampledLoop& loop, Channel channel, const ClampBounds& exact,
                         const ThrustRatioGains& of_class, const Disturbance& known,
                         const OtherErrors& errors, double limit_m_s);

/// `errors` with the constant force d w0 among them.
OtherErrors with_hover_share(OtherErrors errors);

}  // namespace swarmcert::stability
