#include <fcntl.h>
#include <fmt/core.h>
#include <unistd.h>

#if defined(__GLIBC__)
#include <malloc.h>
#endif

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <new>
#include <system_error>

#include "analysis/cli/bundled.h"
#include "analysis/cli/command.h"
#include "analysis/commands/run_command.h"
#include "nn/base/input_error.h"

namespace {

/// Opens descriptors 0 to 2 if the caller closed them. Otherwise the next file opened would get one of these
/// numbers and would receive what the tool prints.
void hold_standard_streams() {
  int descriptor;
  do descriptor = ::open("/dev/null", O_RDWR);
  while (descriptor >= 0 && descriptor <= STDERR_FILENO);
  if (descriptor >= 0) ::close(descriptor);
}

/// Keeps freed memory in the process. Passes over flights allocate and free the same megabytes repeatedly;
/// memory returned to the system in between would come back as pages that must be zeroed first.
void keep_freed_memory() {
#if defined(__GLIBC__)
  ::mallopt(M_TRIM_THRESHOLD, 256 << 20);  // bytes that may stay free at the top of the heap
  ::mallopt(M_MMAP_THRESHOLD, 32 << 20);   // allocations of at least this size are mapped separately
#endif
}

/// Turns success into failure if standard output could not be written.
int after_printing(int code) {
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return code;
  fmt::print(stderr, "swarmcert: standard output: cannot be written ({})\n", std::strerror(errno));
  return code == swarmcert::analysis::kDone ? swarmcert::analysis::kBadInput : code;
}

}  // namespace

int main(int argc, char** argv) {
  hold_standard_streams();
  keep_freed_memory();
  std::signal(SIGXFSZ, SIG_IGN);  // exceeding the file size limit is reported as a write error instead
  try {
    swarmcert::analysis::add_bundled_programs_to_path();
    return after_printing(swarmcert::analysis::run_command(argc, argv));
  } catch (const swarmcert::files::InputError& error) {
    fmt::print(stderr, "swarmcert: {}\n", error.what());
    return swarmcert::analysis::kBadInput;
  } catch (const swarmcert::analysis::UsageError& error) {
    fmt::print(stderr, "swarmcert: {}\n", error.what());
    return swarmcert::analysis::kUsage;
  } catch (const std::filesystem::filesystem_error& error) {
    fmt::print(stderr, "swarmcert: {}: {}\n", error.path1().string(), error.code().message());
    return swarmcert::analysis::kBadInput;
  } catch (const std::system_error& error) {  // thrown by fmt if the disk below standard output is full
    fmt::print(stderr, "swarmcert: {}\n", error.what());
    return swarmcert::analysis::kBadInput;
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr, "swarmcert: the files need more memory than there is\n");
    return swarmcert::analysis::kBadInput;
  } catch (const std::exception& error) {
    fmt::print(stderr, "swarmcert: internal error: {}\n", error.what());
    return swarmcert::analysis::kInternal;
  }
}
