/// @file The memory image that a Cortex-M microcontroller would load from an ELF file, and its function symbols.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace swarmcert::firmware {

struct Segment {
  std::uint32_t address = 0;       ///< load address
  std::uint32_t bytes_in_use = 0;  ///< size from `address`, including zeros that the file does not store
  std::string bytes;
};

struct FunctionSymbol {
  std::string name;
  std::uint32_t address = 0;  ///< bit 0 is set for Thumb code
};

struct ElfImage {
  std::string why_not;  ///< reason why the program cannot be loaded and run; empty if it can
  std::vector<Segment> segments;
  std::vector<FunctionSymbol> functions;  ///< functions with an address in the program
};

/// Reads a linked program for Arm (EM_ARM, ET_EXEC, 32-bit, little-endian). Sizes and offsets in the file are not
/// trusted.
ElfImage read_arm_image(const std::string& bytes);

}  // namespace swarmcert::firmware
