/// @file Bounds when the thrust ratio is known only within an interval.
#pragma once

#include "stability/bounds/disturbance_bounds.h"
#include "stability/bounds/error_parts.h"
#include "stability/bounds/loops/sampled_loop.h"

namespace swarmcert::stability {

/// The actual force is (1 + d) times that of the model, with an unknown constant |d| <= R < 1:
///   m e'' = (1 + d) u + d w0 + f,
/// where u is the feedback's part of the modelled force, w0 the force commanded at hover (the weight on z), and f all
/// other forces.
///
/// Effect on the class of f: (1 + d) u is the loop with gains scaled by 1 + d, so the gains of a class are the largest
/// over that interval (uncertain_norms.h). Several passes are treated as independent single passes; for amplitude and
/// rate together the smaller of the two bounds is used.
///
/// Effect on everything else: d w0 is a constant force. d u is treated as a force on the loop of the model: with
/// U = sup |u| in that loop and E the gain from a force to u, |d u| <= R U / (1 - R E) (small gain), infinite if
/// R E >= 1.
///
/// The feedforward of a network is also scaled by the ratio; d f_hat belongs to f.
struct ThrustRatioGains {
  GainNorms of_class;      ///< largest over the interval, of the channel by which f enters
  double force_per_N = 0;  ///< R / (1 - R E)
  double amplitude = 0;    ///< m/N, for a force on the loop of the model
  double edge = 0;         ///< m/N, for a constant force
};
ThrustRatioGains thrust_ratio_gains(const AxisLoop& loop, Channel channel, double ratio_error);
ThrustRatioGains thrust_ratio_gains(const SampledLoop& loop, Channel channel, double ratio_error);

/// Returns the bounds for the class alone with these gains.
DisturbanceBounds disturbance_bounds(const ThrustRatioGains& gains, const Disturbance& disturbance);

/// Returns what the ratio adds to the bound of any class, m.
/// @param errors with thrust_ratio_error and hover_N.
/// @param errors_N effort_N() of `errors`, including the share of hover_N.
double thrust_ratio_part(const ThrustRatioGains& gains, const OtherErrors& errors, double errors_N);

/// Returns the effect of the integrator's clamp under an uncertain ratio. The demand grows by the demands of d w0 and d
/// u. The bounds while the clamp acts are those of the loop without integral over the interval of the ratio, which also
/// scales the integral's command.
/// @param exact clamp_bounds() of the loop of the model.
/// @param of_class the gains of the whole loop.
ClampBounds clamp_bounds(const AxisLoop& loop, Channel channel, const ClampBounds& exact,
                         const ThrustRatioGains& of_class, const Disturbance& known,
                         const OtherErrors& errors, double limit_m_s);
ClampBounds clamp_bounds(const SampledLoop& loop, Channel channel, const ClampBounds& exact,
                         const ThrustRatioGains& of_class, const Disturbance& known,
                         const OtherErrors& errors, double limit_m_s);

/// Returns `errors` including the constant force d w0.
OtherErrors with_hover_share(OtherErrors errors);

}  // namespace swarmcert::stability
