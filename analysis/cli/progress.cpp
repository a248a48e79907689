#include "analysis/cli/progress.h"

#include <fmt/core.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <ctime>

namespace swarmcert::analysis {
namespace {

/// timeout and other parents send the signal to the process and again to its group: one wish, two deliveries.
constexpr double kOneWish_s = 1;

std::atomic<bool> interrupted{false};
timespec first_interrupt;

void on_interrupt(int) {
  timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  if (!interrupted) {
    first_interrupt = now;
    interrupted = true;
    return;
  }
  const double since_s = static_cast<double>(now.tv_sec - first_interrupt.tv_sec) +
                         1e-9 * static_cast<double>(now.tv_nsec - first_interrupt.tv_nsec);
  if (since_s < kOneWish_s) return;
  std::signal(SIGINT, SIG_DFL);
  std::raise(SIGINT);
}

}  // namespace

Progress::Progress(bool quiet) : quiet_(quiet), terminal_(isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() {
  if (drawn_ && terminal_) fmt::print(stderr, "\r\033[K");
}

void Progress::show(int done, int total, const std::string& what) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (quiet_ || total <= 0 || std::chrono::steady_clock::now() - start_ < std::chrono::seconds(2)) return;
  drawn_ = true;
  if (terminal_) {
    const int filled = 30 * done / total;
    fmt::print(stderr, "\r\033[K[{:#<{}}{:.<{}}] {}/{} {}", "", filled, "", 30 - filled, done, total, what);
    std::fflush(stderr);
  } else if (10 * done / total > last_tenth_) {
    last_tenth_ = 10 * done / total;
    fmt::print(stderr, "{} % {}\n", 10 * last_tenth_, what);
  }
}

CancelOnInterrupt::CancelOnInterrupt() {
  interrupted = false;
  std::signal(SIGINT, on_interrupt);
}

CancelOnInterrupt::~CancelOnInterrupt() { std::signal(SIGINT, SIG_DFL); }

const std::atomic<bool>* CancelOnInterrupt::flag() const { return &interrupted; }

}  // namespace swarmcert::analysis
