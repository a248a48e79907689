/// @file Cortex-M4 programs that tests build from exported source.
#pragma once

#include <cstdlib>
#include <string>

namespace swarmcert::tests {

/// Whether a Cortex-M4 program can be built and run.
inline bool has_cortex_m_tools() {
  return std::system("command -v arm-none-eabi-g++ qemu-system-arm > /dev/null 2>&1") == 0;
}

/// Returns the shell command that builds a bare Cortex-M4 program from `sources`, one of which defines program().
inline std::string cortex_m_build(const std::string& sources, const std::string& output) {
  const std::string folder = SWARMCERT_SOURCE_DIR "/tests/firmware/";
  return "arm-none-eabi-g++ -std=c++17 -O2 -ffp-contract=off -mcpu=cortex-m4 -mthumb -mfloat-abi=hard "
         "-mfpu=fpv4-sp-d16 -fno-exceptions -fno-rtti -fno-threadsafe-statics -nostartfiles "
         "-Wl,--gc-sections -T " +
         folder + "stm32f405.ld -I" + folder + " " + sources + " " + folder + "startup.cpp -o " + output;
}

}  // namespace swarmcert::tests
