/// @file Properties of one Thumb instruction for the cycle model.
///
/// Cycles follow the Cortex-M4 Technical Reference Manual (Arm 100166, "Processor instructions" and "FPU instruction
/// set"): one for arithmetic; two for a load, one if it follows a load or store; 1 + N for N words at once; three for
/// a multiply-accumulate; fourteen for a division or square root. Where the manual gives a range, the model uses the
/// longest. A taken branch takes 1 to 3 additional cycles to refill the pipeline, which the model counts separately.
#pragma once

#include <cstdint>

namespace swarmcert::cycle_model {

inline constexpr int kNoRegister = -1;

struct Instruction {
  std::uint32_t address = 0;
  int size_bytes = 2;
  int cycles = 1;
  bool is_core_access = false;  ///< a load or store of one core register; consecutive ones overlap by a cycle
  bool is_float = false;
  /// Single-precision registers; an instruction that reads the result of the previous one waits a cycle.
  int writes = kNoRegister;
  int reads[2] = {kNoRegister, kNoRegister};
  int marker = 0;  ///< number of DBG, a hint without effect; 0 for any other instruction
};

/// @param bytes [size_bytes] as stored in memory, 2 or 4.
Instruction decode(std::uint32_t address, const void* bytes, int size_bytes);

}  // namespace swarmcert::cycle_model
