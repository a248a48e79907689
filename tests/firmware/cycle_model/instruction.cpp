#include "instruction.h"

#include <cstring>

namespace swarmcert::cycle_model {
namespace {

constexpr int kDivision = 14, kMultiplyAccumulate = 3, kIntegerDivision = 12;

int ones(std::uint32_t bits) { return __builtin_popcount(bits); }

void core_access(Instruction& instruction, bool is_load) {
  instruction.is_core_access = true;
  instruction.cycles = is_load ? 2 : 1;
}

void decode_narrow(Instruction& instruction, std::uint32_t code) {
  const std::uint32_t top = code >> 11;
  if (top == 0x09) return core_access(instruction, true);                                // LDR literal
  if (code >> 12 == 0x5) return core_access(instruction, (code >> 9 & 7) >= 3);          // register offset
  if (code >> 12 >= 0x6 && code >> 12 <= 0x9) return core_access(instruction, top & 1);  // immediate offset
  if (code >> 12 == 0xC || (code & 0xF600) == 0xB400)  // LDM, STM; PUSH, POP with the bit of LR or PC
    instruction.cycles = 1 + ones(code & ((code >> 12 == 0xC) ? 0xFF : 0x1FF));
}

/// Arithmetic, moves and comparisons between floating-point registers.
void decode_float_arithmetic(Instruction& instruction, std::uint32_t first, std::uint32_t second) {
  const std::uint32_t operation = first >> 4 & 0xB;
  const int d = static_cast<int>((second >> 12 & 0xF) << 1 | (first >> 6 & 1));
  const int n = static_cast<int>((first & 0xF) << 1 | (second >> 7 & 1));
  const int m = static_cast<int>((second & 0xF) << 1 | (second >> 5 & 1));
  instruction.writes = d;
  instruction.reads[0] = n;
  instruction.reads[1] = m;
  switch (operation) {
    case 0x0:
    case 0x1:
    case 0x9:
    case 0xA:
      instruction.cycles =
          kMultiplyAccumulate;  // the addend, its destination, is needed late, so there is no wait for it
      break;
    case 0x8:
      instruction.cycles = kDivision;
      break;
    case 0xB: {
      const bool has_operand = (second >> 6 & 1) != 0;  // otherwise an immediate
      const std::uint32_t kind = first & 0xF;
      instruction.reads[0] = has_operand ? m : kNoRegister;
      instruction.reads[1] = kNoRegister;
      if (kind == 1 && (second >> 6 & 3) == 3) instruction.cycles = kDivision;  // VSQRT
      if (kind == 4 || kind == 5) {                                             // VCMP reads d, writes flags
        instruction.reads[0] = d;
        instruction.reads[1] = kind == 4 ? m : kNoRegister;
        instruction.writes = kNoRegister;
      }
      break;
    }
    default:
      break;
  }
}

void decode_float(Instruction& instruction, std::uint32_t first, std::uint32_t second) {
  instruction.is_float = true;
  const bool is_double = (second >> 8 & 1) != 0;  // transfers only: there is no double-precision arithmetic
  const int d = static_cast<int>((second >> 12 & 0xF) << 1 | (first >> 6 & 1));
  if (first >> 8 == 0xEE) {
    if ((second & 0x10) == 0) return decode_float_arithmetic(instruction, first, second);
    const int n =
        static_cast<int>((first & 0xF) << 1 | (second >> 7 & 1));  // VMOV with a core register; VMRS
    if ((first & 0x10) == 0) {
      instruction.writes = n;
    } else {
      instruction.reads[0] = n;
    }
    return;
  }
  const bool is_load = (first & 0x10) != 0;
  const bool is_pair = (first >> 5 & 0x7F) == 0x62;  // 1110110 0010: VMOV of two registers
  if (is_pair) {
    instruction.cycles = 2;
  } else if ((first & 0x120) == 0x100) {  // VLDR, VSTR
    instruction.cycles = is_double ? 3 : 2;
    (is_load ? instruction.writes : instruction.reads[0]) = is_double ? kNoRegister : d;
  } else {
    instruction.cycles = 1 + static_cast<int>(second & 0xFF);
  }
  if (is_load) instruction.writes = kNoRegister;  // the cycles of a load include the wait for its result
}

void decode_wide(Instruction& instruction, std::uint32_t first, std::uint32_t second) {
  const std::uint32_t coprocessor = second >> 9 & 7;
  if (first >> 10 == 0x3B && coprocessor == 5) return decode_float(instruction, first, second);
  if (first >> 9 == 0x74) {  // several words, two words, table branch
    const bool is_multiple = (first & 0x40) == 0;
    instruction.cycles = is_multiple ? 1 + ones(second) : 3;
  } else if (first >> 9 == 0x7C) {
    core_access(instruction, (first & 0x10) != 0);
  } else if (first >> 4 == 0xFB9 || first >> 4 == 0xFBB) {
    instruction.cycles = kIntegerDivision;
  } else if (first == 0xF3AF && (second & 0xFFF0) == 0x80F0) {
    instruction.marker = static_cast<int>(second & 0xF);
  }
}

}  // namespace

Instruction decode(std::uint32_t address, const void* bytes, int size_bytes) {
  Instruction instruction;
  instruction.address = address;
  instruction.size_bytes = size_bytes;
  std::uint16_t halfwords[2] = {};
  std::memcpy(halfwords, bytes, static_cast<std::size_t>(size_bytes == 4 ? 4 : 2));
  if (size_bytes == 4) {
    decode_wide(instruction, halfwords[0], halfwords[1]);
  } else {
    decode_narrow(instruction, halfwords[0]);
  }
  return instruction;
}

}  // namespace swarmcert::cycle_model
