/// @file The memory image that a Cortex-M microcontroller would load from an ELF file, and its symbols.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace swarmcert::firmware {

struct Segment {
  std::uint32_t address = 0;  ///< where the program finds it
  std::uint32_t flashed_at =
      0;  ///< where it is written to; the program's start-up code copies what it finds elsewhere
  std::uint32_t bytes_in_use = 0;  ///< size from `address`, including zeros that the file does not store
  std::string bytes;
};

/// A function or object of the symbol table, global or local.
struct Symbol {
  std::string name;
  std::uint32_t address = 0;  ///< of its first byte
  std::uint32_t size = 0;
  bool is_function = false;
  bool is_thumb = false;  ///< for functions
};

struct ElfImage {
  std::string why_not;  ///< reason why the program cannot be loaded and run; empty if it can
  /// Why tools would flash different programs from this file, some by its sections, some by its segments; empty if they
  /// would not.
  std::string contradiction;
  std::vector<Segment> segments;
  std::vector<Symbol> symbols;  ///< with an address in the program

  /// Returns the symbol of this name, or null.
  const Symbol* find(const std::string& name) const;
  /// Returns `size` bytes at `address`; empty unless the file stores all of them.
  std::string bytes_at(std::uint32_t address, std::uint32_t size) const;
};

/// Reads a linked program for Arm (EM_ARM, ET_EXEC, 32-bit, little-endian). Sizes and offsets in the file are not
/// trusted.
ElfImage read_arm_image(const std::string& bytes);

}  // namespace swarmcert::firmware
