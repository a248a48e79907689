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
#include <system_error>

#include "analysis/cli/command.h"
#include "analysis/commands/run_command.h"
#include "nn/base/input_error.h"

namespace {

/// Descriptors 0 to 2 must be taken: where a caller closed one, the next file opened would get its number, and with it
/// what is printed.
void hold_standard_streams() {
  int descriptor;
  do descriptor = ::open("/dev/null", O_RDWR);
  while (descriptor >= 0 && descriptor <= STDERR_FILENO);
  if (descriptor >= 0) ::close(descriptor);
}

/// Passes over flights free and ask for the same megabytes again and again: given back to the system in between, they
/// come as pages that have to be cleared first.
void keep_freed_memory() {
#if defined(__GLIBC__)
  ::mallopt(M_TRIM_THRESHOLD, 256 << 20);  // bytes that may stay free at the end of the heap
  ::mallopt(M_MMAP_THRESHOLD, 32 << 20);   // bytes from which on a piece has pages of its own
#endif
}

/// If standard output could not be written, a success becomes a failure.
int after_printing(int code) {
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return code;
  fmt::print(stderr, "swarmcert: standard output: cannot be written ({})\n", std::strerror(errno));
  return code == swarmcert::analysis::kDone ? swarmcert::analysis::kBadInput : code;
}

}  // namespace

int main(int argc, char** argv) {
  hold_standard_streams();
  keep_freed_memory();
  std::signal(SIGXFSZ, SIG_IGN);  // a limit on the size of files is an error of writing, with its message
  try {
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
  } catch (const std::system_error& error) {  // fmt's word for a full disk under standard output
    fmt::print(stderr, "swarmcert: {}\n", error.what());
    return swarmcert::analysis::kBadInput;
  } catch (const std::exception& error) {
    fmt::print(stderr, "swarmcert: internal error: {}\n", error.what());
    return swarmcert::analysis::kInternal;
  }
}
