/// @file A tube whose width and centre vary over time: intervals of the errors, slice by slice.
#pragma once

#include <array>
#include <atomic>
#include <functional>
#include <string>
#include <vector>

#include "analysis/tracking/tube/force_difference.h"

namespace swarmcert::analysis {

struct EnclosureOptions {
  int boxes = 32;  ///< maximum number of parts of each slice's set of states
  /// Stops refining when the bound of |f_hat - f_a| is this close to an attained value, relative to the largest bound
  /// at the set points.
  double tolerance = 0.04;
  int jobs = 0;
  const std::atomic<bool>* cancelled = nullptr;
  std::function<void(int done, int total)> progress;
};

struct SlicedTube {
  bool proved = false;
  std::vector<Deviations> slices;                    ///< e and e' of every vehicle per slice; valid if proved
  std::vector<std::vector<Interval>> force_error_N;  ///< [vehicle][slice]: f_hat - f_a along z
  std::vector<std::vector<Forces_N>> truth;          ///< likewise, f_a
  std::vector<std::array<std::vector<double>, 3>> hold_N;  ///< [vehicle][axis][slice]: sup |m x|
  std::string why;                                         ///< reason if not proved
  bool cancelled = false;

  Deviations whole() const;  ///< over all slices
};

/// Finds one interval of e and e' for each vehicle, axis and slice in one pass through time.
///
/// The loop of error_loops.h gives, for t in slice n,
///   e(t) = (h' * d)(t) + (g' * w)(t),   e'(t) = (h'' * d)(t) + (g'' * w)(t),   w = f_a - m p_d'',
/// with d = f_a - f_hat + m x along z and d = f_a + m x along x and y; x lies in the interval that e' and e'' of the
/// slice and of the period before it allow (hold_error.h). A convolution is linear: if the signals of cell k lie in
/// intervals D_k and W_k, errors lie in sums over the kernel's cells m of
///   net_m c + [-1, 1] |.|_m r,   c -+ r = D_{n-m} u D_{n-m-1}   (kernel_cells.h: answer()).
/// So the known part of the signals, the feedforward and the predicted part of the forces, moves the centre of the
/// tube; only the unknown part widens it, through the |kernel| of the time since. Before the start all signals are 0:
/// vehicles start at rest at their setpoints.
///
/// Nothing after slice n enters, and slice n itself only through the kernel's first cell, which is small. Therefore no
/// loop gain below one over the whole flight is needed: with E_0 .. E_{n-1} proved, B_n(E) is the sum above where D_n
/// and W_n enclose the forces over E (and, for what the network saw up to network_age_s() ago, over the slices before).
/// If B_n(E) lies inside E, errors stay in B_n(E) during slice n. Proof: suppose there were a first time t at which an
/// error reaches the boundary of E. All states before t would lie in the set over which the signals were enclosed, and
/// the errors at t in B_n(E), inside E: a contradiction. At the start of the slice they lie in B_n(E) for the same
/// reason. E_n = B_n(E) is kept.
///
/// If the motor lag lies in an interval, each vehicle has a set E for each part of the interval (Scene::lag_parts()) in
/// which its own lag may lie, computed with the kernels of that part; its forces are enclosed over that set and over
/// the sets of its neighbours for all parts. A lag is constant and so stays in one part. The slice of the tube is the
/// union.
/// @param tolerance_N see ForceDifference::refine().
/// @param farthest_m gives up beyond this deviation.
SlicedTube sliced_tube(const Scene& scene, const EnclosureOptions& options, double tolerance_N,
                       double farthest_m = 0.5);

}  // namespace swarmcert::analysis
