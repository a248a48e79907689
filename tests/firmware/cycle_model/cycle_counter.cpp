#include "cycle_counter.h"

#include <algorithm>

namespace swarmcert::cycle_model {
namespace {

constexpr std::uint32_t kFlash = 0x08000000, kFlashEnd = 0x08100000;

bool is_flash(std::uint32_t address) { return address >= kFlash && address < kFlashEnd; }

}  // namespace

bool Cache::holds(std::uint32_t address) {
  const std::uint32_t line = address >> 4;
  const auto found = std::find(recent_.begin(), recent_.end(), line);
  const bool hit = found != recent_.end();
  if (hit) {
    std::rotate(recent_.begin(), found, found + 1);
  } else {
    recent_.insert(recent_.begin(), line);
    if (recent_.size() > lines_) recent_.pop_back();
  }
  return hit;
}

void CycleCounter::fetch(std::uint32_t address) {
  if (is_flash(address) && !instruction_cache_.holds(address)) cycles_ += kWaitStates;
}

void CycleCounter::execute(const Instruction& instruction) {
  ++instructions_;
  cycles_ += static_cast<std::uint64_t>(instruction.cycles);
  fetch(instruction.address);
  if (instruction.size_bytes == 4) fetch(instruction.address + 2);
  if (has_last_) {
    if (instruction.address != last_.address + static_cast<std::uint32_t>(last_.size_bytes))
      ++taken_branches_;
    const bool overlaps = instruction.is_core_access && last_.is_core_access && instruction.cycles == 2;
    if (overlaps) --cycles_;
    const bool waits = instruction.is_float && last_.writes != kNoRegister &&
                       (instruction.reads[0] == last_.writes || instruction.reads[1] == last_.writes);
    if (waits) ++cycles_;
  }
  last_ = instruction;
  has_last_ = true;
}

void CycleCounter::read(std::uint32_t address) {
  if (is_flash(address) && !data_cache_.holds(address)) cycles_ += kWaitStates;
}

}  // namespace swarmcert::cycle_model
