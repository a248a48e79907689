/// @file A tube whose width and middle change over time: intervals of the errors, slice after slice.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "analysis/tracking/tube/force_bound.h"

namespace swarmcert::analysis {

struct SlicedTube {
  bool proved = false;
  std::vector<Deviations> slices;  ///< e and e' of every vehicle, slice by slice; where proved
  std::vector<std::vector<Interval>> force_error_N;        ///< [vehicle][slice]: f_hat - f_a along z
  std::vector<std::vector<TruthSizes>> truth;              ///< likewise
  std::vector<std::array<std::vector<double>, 3>> hold_N;  ///< [vehicle][axis][slice]: sup |m x|
  std::string why;                                         ///< where not proved
  bool cancelled = false;

  Radii radii() const;  ///< the largest of all slices
};

/// One interval of e and e' for each vehicle, axis and slice, found in one pass through time.
///
/// The loop of error_loops.h gives, for t in slice n,
///   e(t) = (h' * d)(t) + (g' * w)(t),   e'(t) = (h'' * d)(t) + (g'' * w)(t),   w = f_a - m p_d'',
/// with d = f_a - f_hat + m x along z and d = f_a + m x along x and y; x lies in what e' and e'' of the slice and of
/// the period before it allow (hold_error.h). A convolution is linear: where the signals of cell k lie in intervals D_k
/// and W_k, errors lie in sums over the kernel's cells m of
///   net_m c + [-1, 1] |.|_m r,   c -+ r = D_{n-m} u D_{n-m-1}   (kernel_cells.h: answer()).
/// So what is known of the signals, the feed-forward and the predicted part of the forces, moves the middle of the
/// tube; only what is not known widens it, through the |kernel| of the time since. Before the start all signals are 0:
/// vehicles start at rest at their set points.
///
/// Nothing after slice n enters, and slice n itself only through the kernel's first cell, which is small. Hence no gain
/// below one over the whole flight is needed: with E_0 .. E_{n-1} proved, B_n(E) is the sum above where D_n and W_n
/// enclose the forces over E (and, for what the network saw up to network_age_s() ago, over the slices before). If
/// B_n(E) lies inside E, errors stay in B_n(E) during slice n. For were there a first time t at which one reaches the
/// border of E, all states before t would lie in what the signals were enclosed over, and the errors at t in B_n(E),
/// inside E: a contradiction; at the slice's start they lie in B_n(E) for the same reason. E_n = B_n(E) is kept.
///
/// Where the motors' lag lies in an interval, each vehicle has a set E for each part of it (Scene::lag_parts()) in
/// which its own lag may lie, made with the kernels of that part; its forces are enclosed over that set and over those
/// of its neighbours of all parts. A lag is constant and so stays in one part. The union is the tube's slice.
/// @param tolerance_N see ForceDifference::refine().
/// @param farthest_m gives up beyond this deviation.
SlicedTube sliced_tube(const Scene& scene, const EnclosureOptions& options, double tolerance_N,
                       double farthest_m = 0.5);

}  // namespace swarmcert::analysis
