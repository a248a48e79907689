/// @file Bundles: all evidence of a release in one folder with one manifest of hashes, and their offline verification.
///
///   DIR/manifest.json  role, size and SHA-256 of every file; hash of its own content
///   DIR/gate.json      result of the gate
///   DIR/files/...      the policy and everything it names, in the original folder layout, so that relative paths hold
#pragma once

#include <string>
#include <vector>

#include "analysis/gate/gate.h"

namespace swarmcert::gate {

/// Writes the bundle of a release that passed, under a temporary name that is then renamed.
/// @param gate_json result of the gate, as text.
/// @return SHA-256 of the manifest, which identifies the bundle.
/// @throws files::InputError if the folder exists, is not empty, and `overwrite` is false; if a file of the release
///     is named by an absolute path, which would point out of the bundle; or if a file changed while it was judged
///     and copied.
std::string write_bundle(const std::string& folder, const Policy& policy, const GateResult& result,
                         const files::Json& gate_json, bool overwrite);

struct BundleVerdict {
  bool accepted = false;
  std::string reason;  ///< reason for rejection
  std::string manifest_sha256;
  std::size_t files = 0;
  std::vector<std::string> verified;  ///< descriptions of what was verified again
};

/// Verifies a bundle. The manifest must be canonical and have the hash that it states; the folder must contain
/// exactly its files, as regular files with the stated sizes and hashes; the gate must have passed the release; the
/// policy must refer to the files of the bundle; the checker must accept the certificate for the bundled weights; and
/// source and ELF must match the weights as in the check [match].
/// @param rerun also repeats every check of the policy, using only the files of the bundle.
BundleVerdict verify_bundle(const std::string& folder, bool rerun, const GateSettings& settings);

}  // namespace swarmcert::gate
