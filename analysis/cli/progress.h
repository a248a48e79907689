/// @file Progress reports of long computations on standard error.
#pragma once

#include <atomic>
#include <chrono>
#include <mutex>
#include <string>

#include "analysis/cli/host.h"

namespace swarmcert::analysis {

/// Shows progress as a redrawn bar on a terminal, otherwise as one line per 10 %. Silent if `quiet`, and for
/// work that takes less than two seconds. Thread-safe. Under a host (host.h) it reports to the host instead.
class Progress {
 public:
  explicit Progress(bool quiet);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// @throws Interrupted if the host has interrupted the command.
  void show(int done, int total, const std::string& what);

 private:
  Host* const host_;
  const bool quiet_;
  const bool terminal_;
  const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::mutex mutex_;
  int last_tenth_ = 0;
  bool drawn_ = false;
};

/// Provides a flag that is set by Ctrl-C (SIGINT) or SIGTERM while an instance exists, or after a time limit.
/// A second signal, at least one second later, ends the process. Under a host, signals are left to the host,
/// which sets the flag.
class CancelOnInterrupt {
 public:
  /// What follows SIGTERM: only the flag, or also the end of the process within a second, whatever it does then.
  enum class Term { kSetsFlag, kEndsInTime };
  /// @param seconds time limit in wall-clock seconds from now; 0: no limit.
  explicit CancelOnInterrupt(double seconds = 0, Term term = Term::kSetsFlag);
  ~CancelOnInterrupt();
  CancelOnInterrupt(const CancelOnInterrupt&) = delete;
  CancelOnInterrupt& operator=(const CancelOnInterrupt&) = delete;

  const std::atomic<bool>* flag() const;

 private:
  Host* const host_;
};

}  // namespace swarmcert::analysis
