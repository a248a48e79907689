/// @file Cycles of a sequence of instructions on the STM32F405 at 168 MHz: a model, not a measurement.
///
/// Flash responds after five wait states. In front of it are the caches of ST's accelerator (RM0090, "Adaptive
/// real-time memory accelerator"): 64 lines of instructions and 8 of data, 16 bytes each, least recently used
/// replacement, initially empty. Not modelled: contention of the two buses, prefetch (a miss always waits in full),
/// interrupts.
/// Compared with known times of the published kernel in cost_test.cmake.
#pragma once

#include <cstdint>
#include <vector>

#include "instruction.h"

namespace swarmcert::cycle_model {

inline constexpr int kWaitStates = 5;
inline constexpr double kClock_MHz = 168;

/// A cache of `lines` lines with least recently used replacement.
class Cache {
 public:
  explicit Cache(std::size_t lines) : lines_(lines) {}
  /// Returns whether the line of `address` was in the cache, and loads it.
  bool holds(std::uint32_t address);

 private:
  std::size_t lines_;
  std::vector<std::uint32_t> recent_;  ///< most recently used first
};

class CycleCounter {
 public:
  void execute(const Instruction& instruction);
  /// Accounts for a word read by the last instruction.
  void read(std::uint32_t address);

  std::uint64_t instructions() const { return instructions_; }
  std::uint64_t taken_branches() const { return taken_branches_; }
  /// Excludes the additional cost of taken branches.
  std::uint64_t cycles() const { return cycles_; }

 private:
  void fetch(std::uint32_t address);

  Cache instruction_cache_{64}, data_cache_{8};
  Instruction last_;
  bool has_last_ = false;
  std::uint64_t instructions_ = 0, taken_branches_ = 0, cycles_ = 0;
};

}  // namespace swarmcert::cycle_model
