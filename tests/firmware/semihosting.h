/// @file Services of the debugger (here QEMU) for a program without an operating system: files, text, exit.
/// Arm, "Semihosting for AArch32 and AArch64": operation in r0, address of the arguments in r1, breakpoint 0xAB.
#pragma once

#include <cstdint>

namespace swarmcert::tests::semihosting {

inline std::uint32_t call(std::uint32_t operation, const void* arguments) {
  register std::uint32_t r0 asm("r0") = operation;
  register const void* r1 asm("r1") = arguments;
  asm volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
  return r0;
}

inline void print(const char* text) { call(0x04, text); }

/// Terminates QEMU with this exit code.
[[noreturn]] inline void exit(std::uint32_t code) {
  const std::uint32_t arguments[] = {0x20026, code};
  call(0x20, arguments);
  for (;;) {
  }
}

/// Creates a binary file; returns -1 on failure.
inline int create(const char* path, std::uint32_t length) {
  const std::uint32_t arguments[] = {reinterpret_cast<std::uint32_t>(path), 5, length};
  return static_cast<int>(call(0x01, arguments));
}

/// Returns whether all bytes were written.
inline bool write(int file, const void* bytes, std::uint32_t size) {
  const std::uint32_t arguments[] = {static_cast<std::uint32_t>(file), reinterpret_cast<std::uint32_t>(bytes),
                                     size};
  return call(0x05, arguments) == 0;
}

inline bool close(int file) {
  const std::uint32_t arguments[] = {static_cast<std::uint32_t>(file)};
  return call(0x02, arguments) == 0;
}

}  // namespace swarmcert::tests::semihosting
