#include <gtest/gtest.h>

#include <cstring>
#include <vector>

#include "cycle_counter.h"

namespace swarmcert::cycle_model {
namespace {

constexpr std::uint32_t kFlash = 0x08000000, kRam = 0x20000000;

/// Decodes `code` as printed in the processor manual: 16 bits, or two halves of 16 bits.
Instruction decoded(std::uint32_t address, std::uint32_t code) {
  const std::uint16_t halves[2] = {static_cast<std::uint16_t>(code >> 16), static_cast<std::uint16_t>(code)};
  if (code >> 16 == 0) return decode(address, &halves[1], 2);
  return decode(address, halves, 4);
}

int cycles(std::uint32_t code) { return decoded(kRam, code).cycles; }

// Encodings as produced by arm-none-eabi-as; cycles from the processor's Technical Reference Manual.
TEST(Instruction, HasTheManualsCycles) {
  EXPECT_EQ(cycles(0x3201), 1) << "adds r2, #1";
  EXPECT_EQ(cycles(0x6862), 2) << "ldr r2, [r4, #4]";
  EXPECT_EQ(cycles(0xf8d48000), 2) << "ldr.w r8, [r4]";
  EXPECT_EQ(cycles(0x9301), 1) << "str r3, [sp, #4]";
  EXPECT_EQ(cycles(0xbdf0), 1 + 5) << "pop {r4-r7, pc}";
  EXPECT_EQ(cycles(0xe92d4ff0), 1 + 9) << "stmdb sp!, {r4-fp, lr}";
  EXPECT_EQ(cycles(0xed920a00), 2) << "vldr s0, [r2]";
  EXPECT_EQ(cycles(0xecfb7a01), 1 + 1) << "vldmia fp!, {s15}";
  EXPECT_EQ(cycles(0xed2d8b02), 1 + 2) << "vpush {d8}";
  EXPECT_EQ(cycles(0xee274a84), 1) << "vmul.f32 s8, s15, s8";
  EXPECT_EQ(cycles(0xee300a04), 1) << "vadd.f32 s0, s0, s8";
  EXPECT_EQ(cycles(0xeea60a87), 3) << "vfma.f32 s0, s13, s14";
  EXPECT_EQ(cycles(0xee060a87), 3) << "vmla.f32 s0, s13, s14";
  EXPECT_EQ(cycles(0xee860a87), 14) << "vdiv.f32 s0, s13, s14";
  EXPECT_EQ(cycles(0xeeb10ac0), 14) << "vsqrt.f32 s0, s0";
  EXPECT_EQ(cycles(0xeeb50ac0), 1) << "vcmpe.f32 s0, #0.0";
}

TEST(Instruction, KnowsTheMarkersOfTheImages) {
  EXPECT_EQ(decoded(kRam, 0xf3af80f1).marker, 1) << "dbg #1";
  EXPECT_EQ(decoded(kRam, 0xf3af80f2).marker, 2) << "dbg #2";
  EXPECT_EQ(decoded(kRam, 0xf3af8000).marker, 0) << "nop.w";
}

TEST(CycleCounter, CountsTakenBranchesAndNoOthers) {
  CycleCounter counter;
  for (const std::uint32_t address : {kRam, kRam + 2, kRam, kRam + 2, kRam + 4})
    counter.execute(decoded(address, 0x3201));
  EXPECT_EQ(counter.taken_branches(), 1u);
  EXPECT_EQ(counter.cycles(), 5u);
}

TEST(CycleCounter, OverlapsLoadsInARow) {
  CycleCounter counter;
  for (std::uint32_t i = 0; i < 4; ++i) counter.execute(decoded(kRam + 2 * i, 0x6862));
  EXPECT_EQ(counter.cycles(), 2u + 3u);
}

TEST(CycleCounter, WaitsForAResultThatIsNeededAtOnce) {
  CycleCounter waits, does_not;
  waits.execute(decoded(kRam, 0xee274a84));      // vmul s8, s15, s8
  waits.execute(decoded(kRam + 4, 0xee300a04));  // vadd s0, s0, s8
  EXPECT_EQ(waits.cycles(), 3u);
  does_not.execute(decoded(kRam, 0xee274a84));
  does_not.execute(decoded(kRam + 4, 0xee700aa4));  // vadd s1, s1, s9
  EXPECT_EQ(does_not.cycles(), 2u);
}

TEST(CycleCounter, WaitsFiveCyclesForEachLineOfFlashThatNoCacheHolds) {
  CycleCounter code;
  for (int pass = 0; pass < 2; ++pass) {
    for (std::uint32_t i = 0; i < 16; ++i) code.execute(decoded(kFlash + 2 * i, 0x3201));
  }
  EXPECT_EQ(code.cycles(), 32u + 2 * kWaitStates) << "two lines, held the second time";
  CycleCounter data;
  for (std::uint32_t line = 0; line < 9; ++line) data.read(kFlash + 16 * line);
  EXPECT_EQ(data.cycles(), 9u * kWaitStates);
  data.read(kFlash + 16);
  EXPECT_EQ(data.cycles(), 9u * kWaitStates) << "eight lines are held";
  data.read(kFlash);
  EXPECT_EQ(data.cycles(), 10u * kWaitStates) << "the oldest gave way";
  data.read(kRam);
  EXPECT_EQ(data.cycles(), 10u * kWaitStates);
}

}  // namespace
}  // namespace swarmcert::cycle_model
