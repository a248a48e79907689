/// @file Marks a piece of work whose instructions and cycles are counted by cycle_model/plugin.cpp.
#pragma once

#include "semihosting.h"

namespace swarmcert::tests {

/// Prints "NAME " and runs `work` between the markers of the plugin, which prints the rest of the line.
template <typename Work>
[[gnu::noinline]] void measure(const char* name, const Work& work) {
  semihosting::print(name);
  semihosting::print(" ");
  asm volatile("dbg #1" ::: "memory");
  work();
  asm volatile("dbg #2" ::: "memory");
}

}  // namespace swarmcert::tests
