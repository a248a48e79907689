#include "analysis/cli/progress.h"

#include <fmt/core.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <ctime>

namespace swarmcert::analysis {
namespace {

/// `timeout` and other parents send a signal to the process and again to its group; signals within this time
/// count as one.
constexpr double kOneWish_s = 1;

/// Longer time limits count as no limit; setitimer() might reject them.
constexpr double kLongestLimit_s = 1e8;

std::atomic<bool> interrupted{false};  ///< by a signal or by the time limit
std::atomic<bool> signalled{false};
timespec first_interrupt;

/// Time in which a process that is asked to end may still finish.
constexpr double kGrace_s = 0.5;

void set_timer(double seconds) {
  itimerval timer{};
  timer.it_value.tv_sec = static_cast<time_t>(seconds);
  timer.it_value.tv_usec = static_cast<suseconds_t>(1e6 * (seconds - std::floor(seconds)));
  setitimer(ITIMER_REAL, &timer, nullptr);
}

void on_time_limit(int) { interrupted = true; }

void end_now(int) {
  std::signal(SIGTERM, SIG_DFL);
  std::raise(SIGTERM);
}

void on_interrupt(int signal) {
  timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  interrupted = true;
  if (!signalled) {
    first_interrupt = now;
    signalled = true;
    return;
  }
  const double since_s = static_cast<double>(now.tv_sec - first_interrupt.tv_sec) +
                         1e-9 * static_cast<double>(now.tv_nsec - first_interrupt.tv_nsec);
  if (since_s < kOneWish_s) return;
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

void on_term(int signal) {
  if (!signalled) {  // only calls that are safe in a signal handler
    std::signal(SIGALRM, end_now);
    set_timer(kGrace_s);
  }
  on_interrupt(signal);
}

}  // namespace

Progress::Progress(bool quiet) : host_(host()), quiet_(quiet), terminal_(isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() {
  if (drawn_ && terminal_) fmt::print(stderr, "\r\033[K");
}

void Progress::show(int done, int total, const std::string& what) {
  if (host_ != nullptr) {
    if (host_->interrupted) throw Interrupted();
    if (host_->progress && total > 0) host_->progress(done, total, what);
    return;
  }
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

CancelOnInterrupt::CancelOnInterrupt(double seconds, Term term) : host_(host()) {
  if (host_ != nullptr) {
    if (seconds > 0) host_->deadline_s = steady_s() + seconds;
    return;
  }
  interrupted = signalled = false;
  std::signal(SIGINT, on_interrupt);
  std::signal(SIGTERM, term == Term::kEndsInTime ? on_term : on_interrupt);
  if (!(seconds > 0 && seconds < kLongestLimit_s)) return;
  std::signal(SIGALRM, on_time_limit);
  set_timer(std::max(seconds, 1e-6));
}

CancelOnInterrupt::~CancelOnInterrupt() {
  if (host_ != nullptr) {
    host_->deadline_s = 0;
    return;
  }
  set_timer(0);
  std::signal(SIGALRM, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
  std::signal(SIGINT, SIG_DFL);
}

const std::atomic<bool>* CancelOnInterrupt::flag() const {
  return host_ != nullptr ? &host_->stop : &interrupted;
}

}  // namespace swarmcert::analysis
