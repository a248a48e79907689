#include "nn/weights/own_process.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <fstream>
#include <memory>

namespace swarmcert::files {
namespace {

constexpr rlim_t kMostSeconds = 60;

void limit(int resource, rlim_t most) {
  rlimit limits{};
  if (getrlimit(static_cast<__rlimit_resource>(resource), &limits) != 0) return;
  limits.rlim_cur = std::min(limits.rlim_cur, most);
  setrlimit(static_cast<__rlimit_resource>(resource), &limits);
}

/// Returns the memory that counts for RLIMIT_DATA: the sixth number of /proc/self/statm, in pages; 0 if unknown.
std::uint64_t data_bytes() {
  std::ifstream in("/proc/self/statm");
  std::uint64_t pages = 0;
  for (int k = 0; k < 6; ++k) in >> pages;
  return in ? pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE)) : 0;
}

[[noreturn]] void run(const std::function<void(std::FILE*)>& work, std::FILE* file,
                      std::uint64_t most_bytes) {
  for (const int signal : {SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGILL}) std::signal(signal, SIG_DFL);
  dup2(open("/dev/null", O_WRONLY), STDERR_FILENO);  // where a crash would be told
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_CPU, kMostSeconds);
  limit(RLIMIT_FSIZE, most_bytes);
  if (const std::uint64_t before = data_bytes()) limit(RLIMIT_DATA, before + most_bytes);
  try {
    work(file);
    _exit(std::fflush(file) == 0 ? 0 : 1);
  } catch (...) {
    _exit(1);
  }
}

}  // namespace

bool in_own_process(const std::function<void(std::FILE*)>& work, const std::function<void(std::FILE*)>& read,
                    std::uint64_t most_bytes) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::tmpfile(), std::fclose);
  if (file == nullptr) return false;
  const pid_t child = fork();
  if (child < 0) return false;
  if (child == 0) run(work, file.get(), most_bytes);
  int status = 0;
  while (waitpid(child, &status, 0) < 0)
    if (errno != EINTR) return false;
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) return false;
  std::rewind(file.get());
  read(file.get());
  return true;
}

}  // namespace swarmcert::files
