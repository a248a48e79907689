/// @file The independent checker: does this certificate prove its statements for these weights?
///
/// It shares no code with what wrote the certificate, trusts no optimiser and never rounds. What it relies on: the
/// readers of weight files, SHA-256, GMP's integers, and the two short files beside this one.
#pragma once

#include <string>
#include <vector>

#include "lipschitz/checker/dyadic.h"
#include "nn/files/json.h"
#include "nn/files/network.h"

namespace swarmcert::check {

inline constexpr const char* kCertificateSchema = "swarmcert/certificate/1";

struct CheckResult {
  bool accepted = false;
  std::string reason;  ///< why not, naming the field; or what was verified
  int upper_bounds = 0;
  int lower_bounds = 0;
  int spectral_norms = 0;
};

/// Verifies every statement of `certificate` against the weights of `network`: content hash; no unknown field; the
/// named weights; each spectral norm from both sides, and what is said of gamma; each upper bound by its linear
/// matrix inequality (lipschitz_lmi.h) or as product of norms verified before; each lower bound by the exact slope
/// between its two witness points. A malformed certificate is answered with a reason, not with an exception.
CheckResult check(const files::Json& certificate, const files::Network& network);

/// M_1 .. M_K of `function` ("network", "phi:<kind>", "rho:<kind>", "set:<phi kind>:<rho kind>"), exactly. In a set
/// function the last layer of phi and the first of rho, which no ReLU separates, are one stage: their product.
/// @throws std::out_of_range if NET has no such function.
std::vector<Matrix> stages(const files::Network& network, const std::string& function);

}  // namespace swarmcert::check
