/// @file A network as firmware source: weights, evaluation, golden vectors, self-test.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "nn/weights/network.h"

namespace swarmcert::firmware {

struct ExportOptions {
  int most_neighbours = 10;        ///< whose states one evaluation takes
  int golden_vectors = 16;         ///< per kind of vehicle
  std::uint64_t seed = 1;          ///< of the golden vectors' inputs
  std::string certificate_sha256;  ///< content hash of the certificate of these weights; empty: none
};

struct SourceFile {
  std::string name, contents;
};

/// Files of the export:
///   swarmcert_network.h    what the firmware includes: deep_set(), predict_force_z(), self_test(), hashes
///   swarmcert_network.cpp  weights as hexadecimal floats, of layer k in the object swarmcert_<part>_<k>: `weight` in
///                          nn::Layout::kBlocks, then `bias`; clamp, scale to newton; golden vectors
///   nn/*.h                 the evaluator, so that the folder builds alone
/// Needs C++17 and nothing else: no heap, no exceptions, no libm.
/// Precondition: every weight is a float32 (files::as_float32()).
/// @throws files::InputError if the network states a unit or quantity that is not a vertical force.
std::vector<SourceFile> export_source(const files::Network& network, const ExportOptions& options);

}  // namespace swarmcert::firmware
