/// @file Progress of long work on standard error.
#pragma once

#include <atomic>
#include <chrono>
#include <mutex>
#include <string>

#include "analysis/cli/host.h"

namespace swarmcert::analysis {

/// Shows how far work is: a bar that redraws itself on a terminal, else a line for every tenth of it. Silent where
/// `quiet`, and for work that ends within two seconds. Safe to call from several threads. Under a host (host.h) it
/// informs the host instead.
class Progress {
 public:
  explicit Progress(bool quiet);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// @throws Interrupted where a host has interrupted the command.
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

/// Set by Ctrl-C (SIGINT) or SIGTERM while an instance exists, or once a time has passed; another such signal a second
/// later ends the process. Under a host, signals are the host's matter: it sets the flag.
class CancelOnInterrupt {
 public:
  /// @param seconds wall clock from now on; 0: no limit.
  explicit CancelOnInterrupt(double seconds = 0);
  ~CancelOnInterrupt();
  CancelOnInterrupt(const CancelOnInterrupt&) = delete;
  CancelOnInterrupt& operator=(const CancelOnInterrupt&) = delete;

  const std::atomic<bool>* flag() const;

 private:
  Host* const host_;
};

}  // namespace swarmcert::analysis
