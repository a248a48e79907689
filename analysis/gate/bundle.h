/// @file Bundles: all evidence of a release in one folder with one signed statement, and their offline verification.
///
///   DIR/statement.json       in-toto Statement v1: the SHA-256 of every file, and the tests passed
///   DIR/statement.dsse.json  the statement in a DSSE envelope, signed by a key of the user; only with a key
///   DIR/bom.cdx.json         CycloneDX bill of materials
///   DIR/gate.json            result of the gate
///   DIR/files/...            the policy and everything it names, in the original folder layout, so that relative paths
///                            hold
#pragma once

#include <string>
#include <vector>

#include "analysis/gate/gate.h"
#include "nn/base/record.h"

namespace swarmcert::gate {

/// Writes the bundle of a release that passed, under a temporary name that is then renamed.
/// @param gate_json result of the gate.
/// @param private_key PEM file of the key that signs the statement; empty: no signature.
/// @return SHA-256 of the statement, which identifies the bundle.
/// @throws files::InputError if the folder exists, is not empty, and `overwrite` is false; if a file of the release
///     is named by an absolute path, which would point out of the bundle; if a file changed while it was judged
///     and copied; or if the key cannot sign.
std::string write_bundle(const std::string& folder, const Policy& policy, const GateResult& result,
                         const files::Json& gate_json, const std::string& private_key, bool overwrite);

struct BundleVerdict {
  bool accepted = false;
  std::string reason;  ///< reason for rejection
  std::string statement_sha256;
  std::size_t files = 0;
  std::vector<std::string> verified;      ///< descriptions of what was verified
  std::vector<std::string> not_verified;  ///< what the verdict does not cover
};

void describe(files::Record& record, const BundleVerdict& verdict);

/// Verifies a bundle. The folder must contain exactly the files of its statement, as regular files with their hashes;
/// the policy that the statement names must refer to exactly these files. Everything else is derived again from the
/// evidence and must be the same: the rows of gate.json, the hashes of its inputs, the statement and the bill of
/// materials. Values of rows may differ in the last digits, which depend on the processor. Certificate, source and ELF
/// are verified whether or not the policy asks for it.
/// @param public_key PEM file of the key that must have signed the statement; empty: without it, whoever can write the
///     bundle can replace it by another one, which not_verified says.
/// @throws files::InputError if there is no such folder, or the key cannot be read.
BundleVerdict verify_bundle(const std::string& folder, const std::string& public_key,
                            const GateSettings& settings);

}  // namespace swarmcert::gate
