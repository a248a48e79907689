// Writes the workload's words to a file:  host VECTORS FILE
#include <cstdio>
#include <cstdlib>
#include <memory>

#include "workload.h"

namespace {

struct FileSink {
  std::FILE* file;
  unsigned long words = 0;
  void operator()(std::uint32_t word) {
    std::fwrite(&word, sizeof word, 1, file);
    ++words;
  }
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  FileSink sink{std::fopen(argv[2], "wb")};
  if (sink.file == nullptr) return 3;
  const auto workload = std::make_unique<swarmcert::tests::Workload<FileSink>>(sink);
  workload->run(static_cast<int>(std::strtol(argv[1], nullptr, 10)));
  if (std::fclose(sink.file) != 0) return 3;
  std::printf("%lu words\n", sink.words);
  return 0;
}
