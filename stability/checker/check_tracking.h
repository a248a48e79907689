/// @file Checker of certificates of tracking gains. Depends on GMP and the JSON reader, but on no search code.
#pragma once

#include <string>

#include "nn/base/json.h"
#include "stability/checker/gain_bounds.h"
#include "stability/checker/sampled_gain_bounds.h"

namespace swarmcert::check {

inline constexpr const char* kTrackingSchema = "swarmcert/tracking-certificate/1";

/// The statement that a certificate must contain verbatim.
inline constexpr const char* kTrackingStatement =
    "For each loop listed, with its numbers taken exactly as they stand: along one axis m e'' = u + f, "
    "e, e', the integral of e and the lags start at zero, and u is -m (Kp (e + p) + Kd (e' + v) + Ki int "
    "(e + p)) + c behind a delay of delay_s and first-order lags of the time constants listed, in "
    "continuous time and without limits. The input w is f (force), c (command), v (velocity, an error of "
    "that estimate) or p (position); the others are zero. Then at all times, in exact arithmetic, |e| <= "
    "rate sup |w'| where w starts at zero, |e| <= amplitude sup |w|, |e| <= edge times the total "
    "variation of w, its first jump included, and |e| <= impulse int |w| dt. Where rate is null, none is "
    "stated. For each sampled loop the same, but every period_s the law reads e + p and e' + v, adds "
    "integrator_step_s (e + p) to I, which starts at zero, and holds the command -m (Kp (e + p) + Kd (e' "
    "+ v) + Ki I) + c until the next one, behind the delay and the lags; f is a function of time, and c, v "
    "and p are one number per period, whose rate is the difference to the one before over period_s, the "
    "one before the first being zero, and whose integral of |w| is the sum of |w| period_s. Lengths are in "
    "m, forces in N, masses in kg, times in s. gains_sha256 and model_sha256 name the files from which the "
    "loops were derived; where both are given, checking compares the hashes and derives the loops anew, up "
    "to a relative 1e-12 for rounding. What is listed under left_out, and every bound made from these "
    "gains, is not certified here.";

struct TrackingVerdict {
  bool accepted = false;
  std::string reason;  ///< why it was rejected, naming the field; or what was verified
  int loops = 0;
  int gains = 0;
};

/// Verifies every gain of `certificate`. A malformed certificate is rejected with a reason, not with an exception.
/// @param gains_sha256, model_sha256 hashes of the files that it must refer to; empty: not compared.
TrackingVerdict check_tracking(const files::Json& certificate, const std::string& gains_sha256,
                               const std::string& model_sha256);

}  // namespace swarmcert::check
