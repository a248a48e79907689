/// @file The values of a network of any activations, one behind each layer, over a box, in exact arithmetic. Not for
/// users.
#pragma once

#include <vector>

#include "lipschitz/checker/activation_bounds.h"
#include "lipschitz/checker/values.h"

namespace swarmcert::check {

/// Contains what leaves every layer of `weights`, before its activation, over the box.
///
/// Two enclosures of each layer are intersected: intervals of what enters (layer_intervals()), and a linear form
/// y = G (x - c) + m + e, |e| <= E, around the middle c of the box, whose error E shrinks with the square of the box.
/// An activation s with slopes in [a, b] over [l, u], the interval of y, takes a form to that of s(y): with p = m,
/// moved into [l, u],
///   |s(y) - s(p) - (a + b) / 2 (y - p)| <= (b - a) / 2 |y - p|.
/// A layer that is sorted leaves intervals. G, m and E are multiples of 2^kValueUnit; what rounding G and m costs is
/// added to E.
/// @param box finite, an interval per input.
std::vector<Intervals> layers_on_box(const files::Weights& weights, const Intervals& box);

/// Around 1, of numbers that an activation leaves as they are: the upper one is above the lower one.
inline const Interval kKeptSlopes{1 - 0x1p-24, 1.0};

/// For each layer but the last, between which slopes each of its numbers is activated over the box. Empty for a layer
/// that is sorted.
std::vector<std::vector<Interval>> slopes_on_box(const files::Weights& weights, const Intervals& box);

}  // namespace swarmcert::check
