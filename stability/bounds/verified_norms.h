/// @file Rigorous enclosures of the norms of an impulse response.
#pragma once

#include <optional>

#include "stability/bounds/axis_loop.h"
#include "stability/bounds/interval.h"

namespace swarmcert::stability {

/// Each holds the exact value, in real arithmetic, for the transfer function whose coefficients are the doubles of
/// step_transfer() (without Ki: impulse_transfer()): they round mass and products of lags once each.
struct VerifiedNorms {
  Interval rate, amplitude, edge, impulse;
};

/// Encloses the gains of a loop without delay; without Ki the rate gain is infinite. Nothing where stability could not
/// be verified.
///
/// Coordinates w = R x are chosen so that the symmetric part of A = R companion R^-1 is verified to lie below -alpha I
/// (interval Cholesky): then |exp(At)|_2 <= e^(-alpha t), so errors of the computed trajectory never grow and its tail
/// is bounded by |w(T)|/alpha. Steps: an approximate matrix exponential; what it misses, rounding included, is bounded
/// per step by interval Taylor coefficients with remainder, and summed. Between steps the response is its Taylor
/// polynomial; stretches where its sign is not certain are halved, down to 2^-30 of a step.
std::optional<VerifiedNorms> verified_norms(const AxisLoop& loop, Channel channel);

}  // namespace swarmcert::stability
