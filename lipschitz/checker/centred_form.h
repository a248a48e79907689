/// @file Values of all layers of a network with any activations over a box, in exact arithmetic. Not for users.
#pragma once

#include <vector>

#include "lipschitz/checker/activation_bounds.h"
#include "lipschitz/checker/values.h"

namespace swarmcert::check {

/// Returns intervals that contain the output of every layer of `weights`, before its activation, over the box.
///
/// Two enclosures of each layer are intersected: interval arithmetic on the layer's inputs (layer_intervals()), and a
/// linear form y = G (x - c) + m + e, |e| <= E, around the centre c of the box, whose error E shrinks quadratically
/// with the size of the box. If the activation s has slopes in [a, b] over the interval [l, u] of y, the form of y
/// gives one of s(y): with p = m clamped to [l, u],
///   |s(y) - s(p) - (a + b) / 2 (y - p)| <= (b - a) / 2 |y - p|.
/// Behind a layer that is sorted only intervals remain. G, m and E are multiples of 2^kValueUnit; the error of rounding
/// G and m is added to E.
/// @param box finite, one interval per input.
std::vector<Intervals> layers_on_box(const files::Weights& weights, const Intervals& box);

/// Slope range used for entries that an activation leaves unchanged: it ends at 1 and is not a single point, because
/// the upper end of a range must be above the lower one.
inline const Interval kKeptSlopes{1 - 0x1p-24, 1.0};

/// Returns for each layer but the last the range of activation slopes of each of its outputs over the box. Empty for a
/// layer that is sorted.
std::vector<std::vector<Interval>> slopes_on_box(const files::Weights& weights, const Intervals& box);

}  // namespace swarmcert::check
