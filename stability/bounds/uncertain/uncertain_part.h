/// @file Bounds on the gains over a subbox of uncertain plants. Not for users.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "nn/base/doubles.h"
#include "stability/bounds/loops/axis_loop.h"
#include "stability/bounds/loops/sampled_loop.h"

namespace swarmcert::stability {

constexpr std::array<double GainNorms::*, 4> kUncertainGains = {&GainNorms::rate, &GainNorms::amplitude,
                                                                &GainNorms::edge, &GainNorms::impulse};
using FourGains = std::array<double, 4>;  ///< rate, amplitude, edge, impulse

/// Thrust-to-mass ratio relative to the one the controller assumes, lag, delay.
using PlantPoint = std::array<double, 3>;

/// The edge of the mass-thrust range on which a box lies. A gain per unit of force is the gain for 1 kg times 1 / mass
/// on kLeastMass, or times ratio / (thrust scale * commanded mass) on kLeastThrust.
enum class PlantEdge { kLeastMass, kLeastThrust };

struct PlantBox {
  PlantEdge edge = PlantEdge::kLeastMass;
  PlantPoint from{}, to{};

  PlantPoint centre() const { return {(from[0] + to[0]) / 2, (from[1] + to[1]) / 2, (from[2] + to[2]) / 2}; }
  double width(std::size_t i) const { return to[i] - from[i]; }
  double ratio_change() const { return width(0) / (to[0] + from[0]); }  ///< relative
  double lag_change() const { return width(1) / 2; }
  double delay_change() const { return width(2) / 2; }
  double largest_ratio() const { return to[0] / centre()[0]; }
  /// Bound on |Delta_L|_1, see uncertain_continuous.cpp.
  double lag_ratio() const {
    const double change = lag_change();
    return change == 0 ? 0 : from[1] > 0 ? 2 * change / from[1] : kInfinity;
  }
};

/// Bounds over a box: every gain per 1 kg (times the ratio on the edge of least thrust) is at most `first_order`, and
/// at most (its largest at the corners + sum of absolute + between_samples)/(1 - sum of relative). On the edge of least
/// thrust, `absolute` is multiplied by the ratio as well.
struct PlantBends {
  FourGains first_order = {kInfinity, kInfinity, kInfinity, kInfinity};
  std::array<PlantPoint, 4> absolute{}, relative{};  ///< by gain, then dimension
  FourGains between_samples{};                       ///< excess of the errors between samples
  PlantPoint share{};  ///< contribution of each dimension to the loop gain around the centre
};

/// x times a gain that may be infinite; 0 if x is 0.
inline double times(double x, double gain) { return x == 0 ? 0 : x * gain; }

/// Returns the loop for 1 kg, with the effective gains at p.
inline AxisLoop plant_at(AxisLoop loop, const PlantPoint& p) {
  loop.mass_kg = 1;
  loop.Kp *= p[0];
  loop.Kd *= p[0];
  loop.Ki *= p[0];
  loop.lags_s.insert(loop.lags_s.begin(), p[1]);
  loop.delay_s = p[2];
  return loop;
}

/// @param fixed the loop without the varying parameters.
PlantBends bends_over(const AxisLoop& fixed, Channel channel, const PlantBox& box);
PlantBends bends_over(const SampledLoop& fixed, Channel channel, const PlantBox& box);

}  // namespace swarmcert::stability
