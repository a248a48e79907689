/// @file All evidence of a release in one folder, with one manifest of hashes; and its verification, offline.
///
///   DIR/manifest.json  role, size and SHA-256 of every file; hash of its own content
///   DIR/gate.json      what the gate found
///   DIR/files/...      the policy and everything it names, in folders as they lay, so that the paths in the files hold
#pragma once

#include <string>
#include <vector>

#include "analysis/gate/gate.h"

namespace swarmcert::gate {

/// Writes the bundle of a release that passed: under a temporary name, then renamed.
/// @param gate_json result of the gate, as text.
/// @return SHA-256 of the manifest: the bundle's identity.
/// @throws files::InputError if the folder is there, is not empty, and `overwrite` is false; if a file of the release
///   is named by an absolute path, which would point out of the bundle; if a file changed while it was judged and
///   copied.
std::string write_bundle(const std::string& folder, const Policy& policy, const GateResult& result,
                         const files::Json& gate_json, bool overwrite);

struct BundleVerdict {
  bool accepted = false;
  std::string reason;  ///< why not
  std::string manifest_sha256;
  std::size_t files = 0;
  std::vector<std::string> verified;  ///< what was checked again, in words
};

/// Verifies: the manifest is canonical and has the hash that it states; the folder holds exactly its files, regular
/// ones, with these sizes and hashes; the gate found that the release passes; the policy's files are the bundle's; the
/// checker accepts the certificate for the bundled weights; source and ELF match them, as the check [match] has it.
/// @param rerun also runs every check of the policy again, on the bundle's files alone.
BundleVerdict verify_bundle(const std::string& folder, bool rerun, const GateSettings& settings);

}  // namespace swarmcert::gate
