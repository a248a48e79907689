/// @file The independent checker: does this certificate prove its statements for these weights?
///
/// It trusts no optimiser. What it relies on: the readers of weight files, SHA-256, GMP's integers, the short files
/// beside this one and, for lower bounds, the exact slope of lipschitz/checker/witness.h. It never rounds, but for
/// proofs on a box (tree_proof.h): those have thousands of parts and are verified in double, with every rounding
/// accounted for.
#pragma once

#include <string>

#include "lipschitz/checker/statement.h"
#include "nn/base/json.h"
#include "nn/weights/network.h"

namespace swarmcert::check {

struct CheckResult {
  bool accepted = false;
  std::string reason;  ///< why not, naming the field; or what was verified
  int spectral_norms = 0;
  int upper_bounds = 0;
  int lower_bounds = 0;
  int on_a_box = 0;  ///< of the upper bounds, those proved part by part
  int values = 0;    ///< functions whose range, jump and float32 error over a box were verified
};

/// NET with the activations that the certificate's chains state, where neither a weight file nor network.toml nor the
/// user does. NET as it is where the certificate is malformed.
files::Network with_stated_activations(const files::Json& certificate, files::Network network);

/// Verifies every statement of `certificate` against the weights of `network`: content hash; no unknown field; the
/// named weights; each spectral norm from both sides; each upper bound by its linear matrix inequality
/// (lipschitz_lmi.h), part by part on a box (tree_proof.h), as product of norms, or by a law from bounds verified
/// before; each lower bound by the exact slope between its two witness points; ranges, jumps and float32 errors layer
/// by layer (values.h), with the 0 and the steps of compositions in which NET is silent. Of functions with another
/// activation than ReLU only bounds for all inputs, by a matrix inequality or by the product, and laws. A malformed
/// certificate is answered with a reason, not with an exception.
CheckResult check(const files::Json& certificate, const files::Network& network);

}  // namespace swarmcert::check
