/// @file What of an ELF a Cortex-M microcontroller would have in its memory, and where its functions begin.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace swarmcert::firmware {

struct Segment {
  std::uint32_t address = 0;       ///< where the program expects it
  std::uint32_t bytes_in_use = 0;  ///< from `address` on, zeros that the file does not hold included
  std::string bytes;
};

struct FunctionSymbol {
  std::string name;
  std::uint32_t address = 0;  ///< bit 0 is set for Thumb code
};

struct ElfImage {
  std::string why_not;  ///< why the program cannot be loaded and run; empty if it can
  std::vector<Segment> segments;
  std::vector<FunctionSymbol> functions;  ///< that have a place in the program
};

/// Reads a linked program for Arm (EM_ARM, ET_EXEC, 32 bit, little-endian). No size or offset in the file is trusted.
ElfImage read_arm_image(const std::string& bytes);

}  // namespace swarmcert::firmware
