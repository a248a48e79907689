// Writes the words of the workload to target.bin in the folder where QEMU runs.
#include "semihosting.h"
#include "workload.h"

#ifndef SWARMCERT_VECTORS
#define SWARMCERT_VECTORS 10000
#endif

namespace semihosting = swarmcert::tests::semihosting;

namespace {

struct FileSink {
  int file = -1;
  bool failed = false;
  std::uint32_t count = 0;
  std::uint32_t words[1024];

  void operator()(std::uint32_t word) {
    words[count++] = word;
    if (count == 1024) flush();
  }
  void flush() {
    failed = failed || !semihosting::write(file, words, 4 * count);
    count = 0;
  }
};

FileSink sink;

}  // namespace

extern "C" int program() {
  // Too large for the stack; constructed when program() runs, after the floating-point unit is enabled.
  static swarmcert::tests::Workload<FileSink> workload(sink);
  sink.file = semihosting::create("target.bin", 10);
  if (sink.file < 0) return 3;
  workload.run(SWARMCERT_VECTORS);
  sink.flush();
  return semihosting::close(sink.file) && !sink.failed ? 0 : 3;
}
