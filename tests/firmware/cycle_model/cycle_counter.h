/// @file Cycles of a run of instructions on the STM32F405 at 168 MHz: a model, not a measurement.
///
/// Flash answers after five wait states; before it stand the caches of ST's accelerator (RM0090, "Adaptive real-time
/// memory accelerator"): 64 lines of instructions and 8 of data, 16 bytes each, the least recently used replaced, empty
/// at the start. Not modelled: contention of the two buses, prefetch (a miss always waits in full), interrupts.
/// Held against what is known of the published kernel: cost_test.cmake.
#pragma once

#include <cstdint>
#include <vector>

#include "instruction.h"

namespace swarmcert::cycle_model {

inline constexpr int kWaitStates = 5;
inline constexpr double kClock_MHz = 168;

/// The least recently used of `lines` lines gives way.
class Cache {
 public:
  explicit Cache(std::size_t lines) : lines_(lines) {}
  /// True if the line of `address` was in the cache; it is afterwards.
  bool holds(std::uint32_t address);

 private:
  std::size_t lines_;
  std::vector<std::uint32_t> recent_;  ///< last used first
};

class CycleCounter {
 public:
  void execute(const Instruction& instruction);
  /// A word that the last instruction reads.
  void read(std::uint32_t address);

  std::uint64_t instructions() const { return instructions_; }
  std::uint64_t taken_branches() const { return taken_branches_; }
  /// Without what taken branches cost more than other instructions.
  std::uint64_t cycles() const { return cycles_; }

 private:
  void fetch(std::uint32_t address);

  Cache instruction_cache_{64}, data_cache_{8};
  Instruction last_;
  bool has_last_ = false;
  std::uint64_t instructions_ = 0, taken_branches_ = 0, cycles_ = 0;
};

}  // namespace swarmcert::cycle_model
