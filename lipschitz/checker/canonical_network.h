/// @file The network in a certificate: the function itself, of which every bound speaks.
///
/// Both checkers read nothing else. That the weight files hold this network is a statement of its own, which
/// first_difference() decides by reading them again.
#pragma once

#include <string>

#include "nn/base/json.h"
#include "nn/weights/network.h"

namespace swarmcert::check {

/// Returns {"description_sha256", "options", "output", "input", "silent", "weights"}: everything that defines the
/// function, each number as a hex float, with the SHA-256 of the files that it was read from. Of each stored network
/// {"file", "sha256", "data_files", "precision", "assumed", "chain", "layers"}, and of each layer its name, the tensor
/// that it was read from (null: folded or rewritten), its numbers, row by row, and the bounds on the rounding of folded
/// numbers.
files::Json canonical_json(const files::Network& network);

/// Reads what canonical_json() wrote. Other fields of `weights`' entries are left to the caller.
/// @throws std::exception unless it is a network: consistent sizes, finite numbers, known activations.
files::Network canonical_network(const files::Json& json);

/// Returns the first difference between two networks, of which `stated` is that of a certificate, tensor by tensor;
/// empty if they are the same function read from the same files.
std::string first_difference(const files::Network& stated, const files::Network& read);

}  // namespace swarmcert::check
