// QEMU plugin: counts instructions and modelled cycles between the markers DBG #1 and DBG #2 of a program. At each
// DBG #2 it prints "INSTRUCTIONS CYCLES TAKEN_BRANCHES" after the output of the program.
//   qemu-system-arm ... -plugin file=libfirmware_cycles.so
#include <cstdio>
#include <deque>
#include <optional>

#include "cycle_counter.h"

// Debian ships no qemu-plugin.h; these are declarations of version 1 of that interface (QEMU 4.2 and later).
extern "C" {
struct qemu_plugin_tb;
struct qemu_plugin_insn;
[[gnu::visibility("default")]] int qemu_plugin_version = 1;
[[gnu::visibility("default")]] int qemu_plugin_install(std::uint64_t id, const void* info, int argc,
                                                       char** argv);
void qemu_plugin_register_vcpu_tb_trans_cb(std::uint64_t id, void (*)(std::uint64_t id, qemu_plugin_tb*));
std::size_t qemu_plugin_tb_n_insns(const qemu_plugin_tb*);
qemu_plugin_insn* qemu_plugin_tb_get_insn(const qemu_plugin_tb*, std::size_t);
const void* qemu_plugin_insn_data(const qemu_plugin_insn*);
std::size_t qemu_plugin_insn_size(const qemu_plugin_insn*);
std::uint64_t qemu_plugin_insn_vaddr(const qemu_plugin_insn*);
void qemu_plugin_register_vcpu_insn_exec_cb(qemu_plugin_insn*, void (*)(unsigned vcpu, void* data), int flags,
                                            void* data);
void qemu_plugin_register_vcpu_mem_cb(qemu_plugin_insn*,
                                      void (*)(unsigned vcpu, std::uint32_t info, std::uint64_t address,
                                               void* data),
                                      int flags, int read_or_write, void* data);
bool qemu_plugin_mem_is_store(std::uint32_t info);
}

namespace {

using namespace swarmcert::cycle_model;

std::deque<Instruction> translated;  // QEMU keeps pointers to them
std::optional<CycleCounter> counter;

void execute(unsigned, void* data) {
  const auto& instruction = *static_cast<const Instruction*>(data);
  if (instruction.marker == 1) {
    counter.emplace();
  } else if (instruction.marker == 2 && counter) {
    std::fprintf(stderr, "%llu %llu %llu\n", static_cast<unsigned long long>(counter->instructions()),
                 static_cast<unsigned long long>(counter->cycles()),
                 static_cast<unsigned long long>(counter->taken_branches()));
    counter.reset();
  } else if (counter) {
    counter->execute(instruction);
  }
}

void access(unsigned, std::uint32_t info, std::uint64_t address, void*) {
  if (counter && !qemu_plugin_mem_is_store(info)) counter->read(static_cast<std::uint32_t>(address));
}

void translate(std::uint64_t, qemu_plugin_tb* block) {
  constexpr int kNoRegisters = 0, kReadsAndWrites = 3;  // QEMU 7.2 interprets 1 (reads only) as writes only
  for (std::size_t i = 0; i < qemu_plugin_tb_n_insns(block); ++i) {
    qemu_plugin_insn* const insn = qemu_plugin_tb_get_insn(block, i);
    translated.push_back(decode(static_cast<std::uint32_t>(qemu_plugin_insn_vaddr(insn)),
                                qemu_plugin_insn_data(insn), static_cast<int>(qemu_plugin_insn_size(insn))));
    qemu_plugin_register_vcpu_insn_exec_cb(insn, execute, kNoRegisters, &translated.back());
    qemu_plugin_register_vcpu_mem_cb(insn, access, kNoRegisters, kReadsAndWrites, nullptr);
  }
}

}  // namespace

int qemu_plugin_install(std::uint64_t id, const void*, int, char**) {
  qemu_plugin_register_vcpu_tb_trans_cb(id, translate);
  return 0;
}
