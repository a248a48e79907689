/// @file Checks whether the evaluation in a linked firmware reproduces the network bit for bit.
#pragma once

#include <string>

#include "nn/weights/network.h"

namespace swarmcert::firmware {

struct CodeMatch {
  enum class Outcome { kSame, kDifferent, kNotChecked };
  Outcome outcome = Outcome::kNotChecked;
  int vectors = 0;         ///< golden vectors run, including the one that differs
  std::string difference;  ///< for kDifferent: the first vector with different bits
  std::string why_not;     ///< for kNotChecked: the reason
};

/// Number of golden vectors per kind of vehicle run by match_code().
inline constexpr int kVectorsOfMatch = 64;

/// Calls swarmcert_network::predict_force_z() of the ELF file in `bytes` on a QEMU Cortex-M4 with golden vectors, and
/// compares status and force in newton bit for bit. This covers evaluator, clamp, scale and sign, as far as the
/// vectors reach, but not who calls the function or with which arguments. The program itself is not started.
/// @param most_neighbours parameter of the export. Precondition: every weight is a float32.
CodeMatch match_code(const files::Network& network, const std::string& bytes, int most_neighbours);

}  // namespace swarmcert::firmware
