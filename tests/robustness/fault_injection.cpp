/// @file Preloaded into the tool: counts its calls that change files, and makes one of them fail or be the last.
///
///   FAULT_LOG   each call is appended here as a line
///   FAULT_AT    number of the call, starting at 1, that fails
///   FAULT_KIND  kill: the process dies there, for a write after half of it; else an errno: the call fails with it,
///               a write after half of it, and so do all later writes
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>

namespace {

std::atomic<int> calls{0};

/// Only for the tool itself, because gnuplot and shells inherit the environment.
bool is_tool() {
  static const bool answer = strcmp(program_invocation_short_name, "swarmcert") == 0;
  return answer;
}

const char* setting(const char* name) {
  const char* value = getenv(name);
  return value == nullptr ? "" : value;
}

bool kills() { return strcmp(setting("FAULT_KIND"), "kill") == 0; }

/// Counts and logs a call. Returns 0 to continue, 1 for the selected call, 2 after it.
int count(const char* what, const char* path) {
  if (!is_tool() || *setting("FAULT_LOG") == '\0') return 0;
  const int number = ++calls;
  static const int log = static_cast<int>(
      syscall(SYS_openat, AT_FDCWD, setting("FAULT_LOG"), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666));
  char line[512];
  const int size = snprintf(line, sizeof line, "%s %s\n", what, path);
  syscall(SYS_write, log, line,
          static_cast<size_t>(size) < sizeof line ? static_cast<size_t>(size) : sizeof line);
  const int at = atoi(setting("FAULT_AT"));
  return at == 0 || number < at ? 0 : number == at ? 1 : 2;
}

void die() { syscall(SYS_kill, syscall(SYS_getpid), SIGKILL); }

/// Returns true and sets errno if the call must fail.
bool fails(const char* what, const char* path) {
  if (count(what, path) != 1) return false;
  if (kills()) die();
  errno = atoi(setting("FAULT_KIND"));
  return true;
}

template <class Function>
Function next(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

bool is_regular(int descriptor) {
  struct stat status = {};
  return descriptor > 2 && fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode);
}

int open_as(const char* name, const char* path, int flags, mode_t mode) {
  if ((flags & O_ACCMODE) != O_RDONLY && strncmp(path, "/dev/", 5) != 0 && fails("open", path)) return -1;
  return next<int (*)(const char*, int, ...)>(name)(path, flags, mode);
}

}  // namespace

extern "C" {

int open(const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(arguments, mode_t) : 0;
  va_end(arguments);
  return open_as("open", path, flags, mode);
}

int open64(const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(arguments, mode_t) : 0;
  va_end(arguments);
  return open_as("open64", path, flags, mode);
}

ssize_t write(int descriptor, const void* bytes, size_t size) {
  static const auto real = next<ssize_t (*)(int, const void*, size_t)>("write");
  if (!is_regular(descriptor)) return real(descriptor, bytes, size);
  const int state = count("write", "");
  if (state == 0 || (state == 2 && kills())) return real(descriptor, bytes, size);
  if (state == 1) {
    const ssize_t half = real(descriptor, bytes, size / 2);
    if (kills()) die();
    if (half > 0) return half;  // a full disk accepts part of a write; the next call fails
  }
  errno = atoi(setting("FAULT_KIND"));
  return -1;
}

int fsync(int descriptor) {
  if (is_regular(descriptor) && fails("fsync", "")) return -1;
  return next<int (*)(int)>("fsync")(descriptor);
}

int rename(const char* from, const char* to) {
  if (fails("rename", to)) return -1;
  return next<int (*)(const char*, const char*)>("rename")(from, to);
}

int renameat2(int from_folder, const char* from, int to_folder, const char* to, unsigned int flags) {
  if (fails("rename", to)) return -1;
  return next<int (*)(int, const char*, int, const char*, unsigned int)>("renameat2")(from_folder, from,
                                                                                      to_folder, to, flags);
}

int mkdir(const char* path, mode_t mode) {
  if (fails("mkdir", path)) return -1;
  return next<int (*)(const char*, mode_t)>("mkdir")(path, mode);
}

}  // extern "C"
