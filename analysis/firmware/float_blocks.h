/// @file The floating point numbers that a firmware file stores: C or C++ source, or an ELF.
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace swarmcert::firmware {

/// As a compiler stores it.
inline std::uint32_t float_bits(float value) {
  std::uint32_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  return bits;
}

/// Numbers stored one after another under one name.
struct FloatBlock {
  std::string name;  ///< variable, "variable.member", symbol, or section where there are no symbols
  std::vector<std::uint32_t> bits;   ///< of float32, as a compiler stores them
  std::vector<std::uint32_t> lines;  ///< source: of each number
  std::uint64_t address = 0;         ///< ELF: of the first number

  /// "line 12", or "address 0x8004a10".
  std::string place(std::size_t index) const;
};

/// Every brace-enclosed initialiser of numbers in C or C++ source. Numbers are taken as a compiler takes them for a
/// float: with suffix f rounded once, without it first to double; decimal and hexadecimal.
/// @throws files::InputError if nothing of the kind is in the text.
std::vector<FloatBlock> blocks_in_source(const std::string& text, const std::string& path);

/// True if `bytes` begin like an ELF.
bool is_elf(const std::string& bytes);

/// The data of a little-endian ELF (32 or 64 bit): one block per object symbol, and one per allocated section that
/// holds bytes, for files without symbols. No size or offset in the file is trusted.
/// @throws files::InputError with the field if the file is damaged or big-endian.
std::vector<FloatBlock> blocks_in_elf(const std::string& bytes, const std::string& path);

}  // namespace swarmcert::firmware
