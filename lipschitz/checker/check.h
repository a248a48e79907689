/// @file The independent checker: does this certificate prove its statements for these weights?
///
/// It trusts no optimiser and never rounds. What it relies on: the readers of weight files, SHA-256, GMP's integers,
/// the two short files beside this one and, for lower bounds, the exact slope of lipschitz/witness.h.
#pragma once

#include <string>
#include <vector>

#include "lipschitz/checker/dyadic.h"
#include "nn/files/json.h"
#include "nn/files/network.h"

namespace swarmcert::check {

inline constexpr const char* kCertificateSchema = "swarmcert/certificate/1";

/// What a certificate of this schema states, in words.
inline constexpr const char* kStatement =
    "ReLU networks with the weights stored in the files named by sha256. Every bound holds in exact "
    "arithmetic: "
    "|f(x) - f(y)| <= upper |x - y| for all x and y, and |f(x) - f(y)| >= lower |x - y| at the witness. In a "
    "set "
    "function one neighbour moves from x to y, whatever the number and the places of the others.";

struct CheckResult {
  bool accepted = false;
  std::string reason;  ///< why not, naming the field; or what was verified
  int spectral_norms = 0;
  int upper_bounds = 0;
  int lower_bounds = 0;
};

/// Verifies every statement of `certificate` against the weights of `network`: content hash; no unknown field; the
/// named weights; each spectral norm from both sides; each upper bound by its linear
/// matrix inequality (lipschitz_lmi.h) or as product of norms verified before; each lower bound by the exact slope
/// between its two witness points. A malformed certificate is answered with a reason, not with an exception.
CheckResult check(const files::Json& certificate, const files::Network& network);

/// M_1 .. M_K of `function` ("network", "phi:<kind>", "rho:<kind>", "set:<phi kind>:<rho kind>"), exactly. In a set
/// function the last layer of phi and the first of rho, which no ReLU separates, are one stage: their product.
/// @throws std::out_of_range if NET has no such function.
std::vector<Matrix> stages(const files::Network& network, const std::string& function);

}  // namespace swarmcert::check
