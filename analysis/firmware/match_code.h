/// @file Whether the evaluation in a linked firmware gives the bits of the network.
#pragma once

#include <string>

#include "nn/weights/network.h"

namespace swarmcert::firmware {

struct CodeMatch {
  enum class Outcome { kSame, kDifferent, kNotChecked };
  Outcome outcome = Outcome::kNotChecked;
  int vectors = 0;         ///< golden vectors that were run, the one that differs included
  std::string difference;  ///< kDifferent: the first vector that gives other bits
  std::string why_not;     ///< kNotChecked
};

/// Golden vectors per kind of vehicle that match_code() runs.
inline constexpr int kVectorsOfMatch = 64;

/// Calls swarmcert_network::predict_force_z() of the ELF in `bytes` on a Cortex-M4 of QEMU with golden vectors, and
/// compares status and force in newton bit for bit. This covers evaluator, clamp, scale and sign, as far as the vectors
/// reach, and neither who calls the function nor with what. The program itself is not started.
/// @param most_neighbours that the export was made with.
/// Precondition: every weight is a float32.
CodeMatch match_code(const files::Network& network, const std::string& bytes, int most_neighbours);

}  // namespace swarmcert::firmware
