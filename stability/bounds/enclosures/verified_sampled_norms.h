/// @file Rigorous enclosures of the gains of a sampled loop.
#pragma once

#include "stability/bounds/enclosures/verified_norms.h"
#include "stability/bounds/loops/sampled_loop.h"

namespace swarmcert::stability {

struct VerifiedSampledNorms {
  VerifiedNorms at_samples;  ///< of the errors at the sampling times
  VerifiedNorms all_times;   ///< also between samples
};

/// Encloses the results of sampled_norms(), in real arithmetic, for the doubles of `loop`; a delay within 1e-9 periods
/// of a whole number of periods is treated as that number. Without Ki the rate gains are infinite. Returns nothing if
/// stability could not be verified.
///
/// The kernel is a row over the states, propagated from period to period by a matrix that contracts in the coordinates
/// of contracting_sampled_system.h, so errors of the computed row never grow; the sums and the tail follow from
/// (I - A)^-1, enclosed by its residual. The kernel is a polynomial on each period; runs of one sign are summed by the
/// difference of an antiderivative between their ends. Between samples, with e_i the errors at quarters of a period,
/// |e| <= max |e_i| + (period/4)^2/8 sup|e''|: since e'' is a convex combination of commands and lag outputs, plus the
/// disturbance, its gain is that of the largest of them.
std::optional<VerifiedSampledNorms> verified_sampled_norms(const SampledLoop& loop, Channel channel);

/// The same for errors of an estimate, read once per period.
std::optional<VerifiedSampledNorms> verified_sampled_norms(const SampledLoop& loop, Estimate estimate);

}  // namespace swarmcert::stability
