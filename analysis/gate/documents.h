/// @file The two documents of a bundle in the forms of others: an in-toto Statement and a CycloneDX bill of materials.
#pragma once

#include <string>
#include <vector>

#include "analysis/gate/gate.h"
#include "nn/base/json.h"

namespace swarmcert::gate {

/// A file of a bundle.
struct BundledFile {
  std::string path, role, sha256;  ///< path relative to the bundle
};

/// Returns an in-toto Statement v1 with a test-result predicate v0.1. Subjects are all files but policy and baseline,
/// which are the configuration of the test; every row of the gate is a passed test.
/// Sources: https://github.com/in-toto/attestation, spec/v1/statement.md and spec/predicates/test-result.md.
files::Json statement_of(const std::vector<BundledFile>& files, const files::Json& rows);

/// Returns a CycloneDX 1.6 ML-BOM: the network with its model card (parts, inputs, output, the gate's rows as metrics),
/// and every file with its hash and role. Source: https://cyclonedx.org/docs/1.6/json.
files::Json bill_of_materials(const files::Network* network, const std::vector<BundledFile>& files,
                              const files::Json& rows);

}  // namespace swarmcert::gate
