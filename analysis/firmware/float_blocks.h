/// @file The floating-point numbers stored in a firmware file: C or C++ source, or an ELF file.
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace swarmcert::firmware {

/// The bits of a float as stored by a compiler.
inline std::uint32_t float_bits(float value) {
  std::uint32_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  return bits;
}

/// Numbers stored consecutively under one name.
struct FloatBlock {
  std::string name;  ///< variable, "variable.member", symbol, or section if there are no symbols
  std::vector<std::uint32_t> bits;   ///< float32 bits as stored by a compiler
  std::vector<std::uint32_t> lines;  ///< for source: line of each number
  std::uint64_t address = 0;         ///< for ELF: address of the first number

  /// Returns "line 12", or "address 0x8004a10".
  std::string place(std::size_t index) const;
};

/// Returns every brace-enclosed initialiser of numbers in C or C++ source. Numbers are converted as a compiler does
/// for a float: with suffix f rounded once, without it first rounded to double; decimal and hexadecimal.
/// @throws files::InputError if the text contains no such initialiser.
std::vector<FloatBlock> blocks_in_source(const std::string& text, const std::string& path);

/// True if `bytes` start like an ELF file.
bool is_elf(const std::string& bytes);

/// Returns the data of a little-endian ELF file (32- or 64-bit): one block per object symbol, and one per allocated
/// section with contents, for files without symbols. Sizes and offsets in the file are not trusted.
/// @throws files::InputError with the field if the file is damaged or big-endian.
std::vector<FloatBlock> blocks_in_elf(const std::string& bytes, const std::string& path);

}  // namespace swarmcert::firmware
