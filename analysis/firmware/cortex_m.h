/// @file A QEMU Cortex-M4 that calls single functions of a program through QEMU's debugger interface.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <stdexcept>
#include <string>

namespace swarmcert::firmware {

/// QEMU is not installed, has ended or does not answer as expected, or a call did not return.
struct NotRun : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A machine with the memory of an STM32F405 but no clock, device, operating system, or access to the host:
/// semihosting is off, so that a program can only compute.
class CortexM {
 public:
  static constexpr std::uint32_t kFlash = 0x08000000, kFlashSize = 1024 * 1024;
  /// QEMU's machine has 64 KiB more RAM than the microcontroller; the last 32 KiB hold the stack and arguments of a
  /// call.
  static constexpr std::uint32_t kRam = 0x20000000, kRamSize = 160 * 1024;
  static constexpr std::uint32_t kArguments = kRam + kRamSize, kArgumentsSize = 20 * 1024;

  /// Starts qemu-system-arm and enables the floating-point unit.
  /// @throws NotRun
  CortexM();
  ~CortexM();
  CortexM(const CortexM&) = delete;
  CortexM& operator=(const CortexM&) = delete;

  /// @throws NotRun if the range is outside the memories above.
  void write(std::uint32_t address, const std::string& bytes);
  std::uint32_t read_word(std::uint32_t address);
  std::string read(std::uint32_t address, std::uint32_t size);

  /// Calls the Thumb function at `address` according to the AAPCS, with four words in registers and one on the stack.
  /// @return r0.
  /// @throws NotRun after a fault, or if the function has not returned after kMostSeconds.
  std::uint32_t call(std::uint32_t address, const std::uint32_t (&in_registers)[4], std::uint32_t on_stack);

  /// Calls the Thumb function at `address`, which takes nothing, until it calls the function at `callee` for the second
  /// time; the first call returns at once. Both addresses must stay the same.
  /// @throws NotRun as call(), and if it returns before.
  void call_until_second(std::uint32_t address, std::uint32_t callee);

  static constexpr int kMostSeconds = 20;

 private:
  std::string request(const std::string& command);
  std::string reply();
  void need_ok(const std::string& command);
  void set_register(int number, std::uint32_t value);
  std::uint32_t get_register(int number);
  /// Runs from `address`, with a return address at which it stops. Returns where it stopped.
  std::uint32_t run_from(std::uint32_t address);
  char next_byte();

  pid_t child_ = -1;
  int socket_ = -1;
  std::uint32_t watched_ = 0;  ///< callee of call_until_second(), where execution stops
  std::string received_;
  std::size_t taken_ = 0;
};

}  // namespace swarmcert::firmware
