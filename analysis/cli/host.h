/// @file A program that runs commands in its own process, as the Python module does.
#pragma once

#include <atomic>
#include <chrono>
#include <exception>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "nn/base/json.h"
#include "nn/weights/network.h"

namespace swarmcert::analysis {

/// What a program gives to one run of a command, and what it gets back. While it is the host of a thread, a command
/// that this thread runs prints nothing and handles no signal.
struct Host {
  // --- inputs ---
  std::optional<files::Network> network;   ///< NET, in place of files
  std::optional<std::string> certificate;  ///< text of the certificate that `check` takes, in place of a file
  /// Called by the threads of the command, perhaps by several at once. Must not throw.
  std::function<void(int done, int total, const std::string& what)> progress;

  // --- while it runs ---
  /// The host sets both to end the command: those that stop early see `stop`, all others throw Interrupted when they
  /// next report progress.
  std::atomic<bool> stop{false}, interrupted{false};
  /// The host sets `stop`, and not `interrupted`, at this time of steady_clock, in seconds; 0: never.
  std::atomic<double> deadline_s{0};

  // --- outputs ---
  files::Json result;               ///< what --json would have written
  std::string certificate_written;  ///< text of the certificate that `certify` made
  std::vector<std::string> notes;   ///< lines that would have gone to standard error
};

/// Seconds of steady_clock, as Host::deadline_s counts them.
inline double steady_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Thrown by Progress::show() after Host::interrupted was set.
struct Interrupted : std::exception {
  const char* what() const noexcept override { return "interrupted"; }
};

/// The host of the calling thread; nullptr on the command line.
Host* host();

/// Makes `host` that of the calling thread for as long as this lives.
class HostScope {
 public:
  explicit HostScope(Host& host);
  ~HostScope();
  HostScope(const HostScope&) = delete;
  HostScope& operator=(const HostScope&) = delete;
};

/// A line for standard error, or for Host::notes.
void note(const std::string& line);

}  // namespace swarmcert::analysis
