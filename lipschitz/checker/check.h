/// @file The independent checker: decides whether a certificate proves its statements for given weights.
///
/// It trusts no optimiser. It relies on the readers of weight files, SHA-256, GMP's integers, the short files in this
/// folder and, for lower bounds, the exact slope of lipschitz/checker/witness.h. It works in exact arithmetic except
/// for proofs on a box (tree_proof.h): these have thousands of parts and are verified in double, with bounds on all
/// round-off errors.
#pragma once

#include <string>

#include "lipschitz/checker/statement.h"
#include "nn/base/json.h"
#include "nn/weights/network.h"

namespace swarmcert::check {

struct CheckResult {
  bool accepted = false;
  std::string reason;  ///< why it was refused, naming the field; or what was verified
  int spectral_norms = 0;
  int upper_bounds = 0;
  int lower_bounds = 0;
  int on_a_box = 0;  ///< number of upper bounds that were proved part by part
  int values = 0;    ///< number of functions whose range, jump and float32 error over a box were verified
};

/// Returns NET with the activations that the certificate states for parts whose activation is given neither by a weight
/// file nor by network.toml nor by the user. Returns NET unchanged if the certificate is malformed.
files::Network with_stated_activations(const files::Json& certificate, files::Network network);

/// Verifies every statement of `certificate` against the weights of `network`:
/// - the content hash, the named weights, and that there is no unknown field;
/// - the upper and lower bound on each spectral norm;
/// - each upper bound: by its linear matrix inequality (lipschitz_lmi.h), part by part on a box (tree_proof.h), as a
///   product of norms, or by a law from bounds that are already verified;
/// - each lower bound: by the exact slope between its two witness points;
/// - ranges, jumps and float32 errors, layer by layer (values.h), including the value 0 and the steps of compositions
///   in which NET is silent.
/// Upper bounds of functions with an activation other than ReLU are accepted only by a matrix inequality, by the
/// product or by a law. A malformed certificate yields a reason, not an exception.
CheckResult check(const files::Json& certificate, const files::Network& network);

}  // namespace swarmcert::check
