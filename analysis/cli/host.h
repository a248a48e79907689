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

/// What a program passes to one run of a command and what it gets back. While a thread has a host, commands
/// run by this thread print nothing and install no signal handlers.
struct Host {
  // --- inputs ---
  std::optional<files::Network> network;   ///< NET, in place of files
  std::optional<std::string> certificate;  ///< text of the certificate that `check` reads, in place of a file
  /// Called by the command's threads, possibly concurrently. Must not throw.
  std::function<void(int done, int total, const std::string& what)> progress;

  // --- while it runs ---
  /// The host sets both flags to end the command. Commands that support early stopping return when they see
  /// `stop`; all others throw Interrupted at their next progress report.
  std::atomic<bool> stop{false}, interrupted{false};
  /// The host sets `stop` but not `interrupted` at this steady_clock time in seconds; 0: never.
  std::atomic<double> deadline_s{0};

  // --- outputs ---
  files::Json result;               ///< what --json would write
  std::string certificate_written;  ///< text of the certificate written by `certify`
  std::vector<std::string> notes;   ///< lines that would otherwise go to standard error
};

/// Current steady_clock time in seconds, the time base of Host::deadline_s.
inline double steady_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Thrown by Progress::show() once Host::interrupted is set.
struct Interrupted : std::exception {
  const char* what() const noexcept override { return "interrupted"; }
};

/// Returns the host of the calling thread; nullptr on the command line.
Host* host();

/// Makes `host` the host of the calling thread for the lifetime of this object.
class HostScope {
 public:
  explicit HostScope(Host& host);
  ~HostScope();
  HostScope(const HostScope&) = delete;
  HostScope& operator=(const HostScope&) = delete;
};

/// Writes a line to standard error, or appends it to Host::notes under a host.
void note(const std::string& line);

}  // namespace swarmcert::analysis
