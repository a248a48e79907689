/// @file The Crazyflie app with an exported network, linked with the stub firmware as the stock firmware links it.
#pragma once

#include <string>
#include <vector>

#include "firmware/exported_network.h"

namespace swarmcert::tests {

/// Exports the network of FirmwareTest and links the app with it. `app/` and `out/` are copies of the sources, which
/// tests change before they build again.
class AppImageTest : public FirmwareTest {
 protected:
  void SetUp() override {
    if (!has_cortex_m_tools()) GTEST_SKIP() << "needs arm-none-eabi-g++ and qemu-system-arm";
    FirmwareTest::SetUp();
    const Outcome copied =
        run("mkdir -p app objects && cp " SWARMCERT_SOURCE_DIR "/controller/crazyflie/src/* app");
    ASSERT_EQ(copied.exit_code, 0) << copied.output;
    for (const std::string name : {"flight", "network", "network_task", "parameters"})
      compile("app/" + name, name);
    compile(kStub + "stub", "stub");
    compile(kStub + "firmware", "firmware");
    const Outcome built =
        run(kCompiler + " -c " SWARMCERT_SOURCE_DIR "/tests/firmware/startup.cpp -o objects/startup.o -I" +
            std::string(SWARMCERT_SOURCE_DIR "/tests/firmware"));
    ASSERT_EQ(built.exit_code, 0) << built.output;
    ASSERT_EQ(link("app.elf").exit_code, 0);
  }

  /// Compiles SOURCE.cpp (or .c) into objects/NAME.o, with the flags of the stock firmware and of the app's Kbuild.
  void compile(const std::string& source, const std::string& name, const std::string& network = "out") {
    const bool is_c = name == "parameters";
    const std::string includes =
        " -I. -Iapp -I" + network +
        " -I" SWARMCERT_SOURCE_DIR " -I" SWARMCERT_SOURCE_DIR "/controller/crazyflie/interface -I" + kStub;
    const Outcome built = run((is_c ? kCCompiler : kCompiler) + includes + " -c " + source +
                              (is_c ? ".c" : ".cpp") + " -o objects/" + name + ".o");
    EXPECT_EQ(built.exit_code, 0) << built.output;
  }

  /// Links all objects, without throwing away what nobody calls, as an attacker would.
  Outcome link(const std::string& image, const std::string& options = "-Wl,--gc-sections",
               const std::string& more = "") {
    return run(kCompiler + " -nostartfiles -T " + script_ + " " + options +
               " objects/startup.o objects/firmware.o objects/stub.o objects/flight.o objects/network.o "
               "objects/network_task.o objects/parameters.o " +
               more + " -o " + image);
  }

  std::string script_ = SWARMCERT_SOURCE_DIR "/tests/firmware/stm32f405.ld";
  static inline const std::string kStub = SWARMCERT_SOURCE_DIR "/tests/firmware/crazyflie_stub/";
  static inline const std::string kFlags =
      " -mcpu=cortex-m4 -mthumb -mfpu=fpv4-sp-d16 -mfloat-abi=hard -Os -fno-math-errno -fno-strict-aliasing "
      "-ffunction-sections -fdata-sections -O2 -ffp-contract=off";
  static inline const std::string kCompiler =
      "arm-none-eabi-g++ -std=gnu++17 -fno-exceptions -fno-rtti -fno-threadsafe-statics" + kFlags;
  static inline const std::string kCCompiler = "arm-none-eabi-gcc -std=gnu11" + kFlags;
};

}  // namespace swarmcert::tests
