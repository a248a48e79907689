// From reset to program() on the STM32F405: enables floating point, copies data, clears zeros. A fault prints and ends.
#include <cstdint>

#include "semihosting.h"

extern "C" {
extern std::uint32_t data_begin, data_end, data_load, bss_begin, bss_end, stack_end;
extern void (*init_begin[])();
extern void (*init_end[])();
int program();

[[noreturn]] void fault() {
  swarmcert::tests::semihosting::print("FAULT\n");
  swarmcert::tests::semihosting::exit(99);
}

[[noreturn]] void reset() {
  *reinterpret_cast<volatile std::uint32_t*>(0xE000ED88) |= 0xFu << 20;  // CPACR: coprocessors 10 and 11
  asm volatile("dsb\n isb" ::: "memory");
  const std::uint32_t* from = &data_load;
  for (volatile std::uint32_t* to = &data_begin; to != &data_end; to = to + 1) *to = *from++;
  for (volatile std::uint32_t* to = &bss_begin; to != &bss_end; to = to + 1) *to = 0;
  for (void (**function)() = init_begin; function != init_end; ++function) (*function)();
  swarmcert::tests::semihosting::exit(static_cast<std::uint32_t>(program()));
}

/// Stack pointer, reset, then fourteen exceptions, none of which should occur.
[[gnu::section(".isr_vector"), gnu::used]] const void* const vectors[16] = {
    &stack_end,
    reinterpret_cast<const void*>(reset),
    reinterpret_cast<const void*>(fault),
    reinterpret_cast<const void*>(fault),
    reinterpret_cast<const void*>(fault),
    reinterpret_cast<const void*>(fault),
    reinterpret_cast<const void*>(fault)};
}
