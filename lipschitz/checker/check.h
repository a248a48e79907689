/// @file The independent checker: decides whether a certificate proves its statements about the network it carries.
///
/// It trusts no optimiser. It relies on SHA-256, GMP's integers, the short files in this folder and, for lower bounds,
/// the exact slope of lipschitz/checker/witness.h; on no reader of weight files. It works in exact arithmetic except
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

/// Parses a certificate.
/// @throws InputError if it is not one, or is older than the schema; the hint renews it.
files::Json parse_certificate(const std::string& text, const std::string& path);

/// Returns `arguments` with the options that they leave open as the certificate's network was read: key, order,
/// selection and activation.
files::NetworkArguments with_stated_options(const files::Json& certificate,
                                            files::NetworkArguments arguments);

/// Verifies every statement of `certificate` about the network in it (canonical_network.h):
/// - the content hash, and that there is no unknown field;
/// - the upper and lower bound on each spectral norm;
/// - each upper bound: by its linear matrix inequality (lipschitz_lmi.h), part by part on a box (tree_proof.h), as a
///   product of norms, or by a law from bounds that are already verified;
/// - each lower bound: by the exact slope between its two witness points;
/// - ranges, jumps and float32 errors, layer by layer (values.h), including the value 0 and the steps of compositions
///   in which NET is silent.
/// Upper bounds of functions with an activation other than ReLU are accepted only by a matrix inequality, by the
/// product or by a law. A malformed certificate yields a reason, not an exception.
CheckResult check(const files::Json& certificate);

/// Same, after verifying that `network`, as its files were read, is the network in the certificate.
CheckResult check(const files::Json& certificate, const files::Network& network);

}  // namespace swarmcert::check
