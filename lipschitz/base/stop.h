/// @file Cancellation and time limits, and how the time of a command is divided among tasks.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <mutex>
#include <optional>

#include "nn/base/parallel.h"

namespace swarmcert::lipschitz {

/// A stop condition: a cancellation flag, a time limit, both or neither. Copies share the flag.
class Stop {
 public:
  using Clock = std::chrono::steady_clock;

  Stop() = default;  ///< Never stops.
  /// @param flag not owned; null: none.
  /// @param seconds limit from now on; 0: no limit.
  explicit Stop(const std::atomic<bool>* flag, double seconds = 0) : flag_(flag) {
    // Longer limits would overflow the clock and count as no limit.
    constexpr double kLongest_s = 1e8;
    if (seconds > 0 && seconds < kLongest_s)
      at_ =
          Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  }

  bool is_cancelled() const { return flag_ != nullptr && *flag_; }
  bool is_out_of_time() const { return at_ && Clock::now() >= *at_; }
  bool now() const { return is_cancelled() || is_out_of_time(); }
  bool has_limit() const { return at_.has_value(); }

  /// Returns the seconds until the limit, or 0 after it has passed. Precondition: has_limit().
  double seconds_left() const {
    return std::max(0.0, std::chrono::duration<double>(*at_ - Clock::now()).count());
  }
  /// Returns a stop with the same flag that allows this share of the remaining time, if there is a limit.
  Stop after_share(double share) const {
    return has_limit() ? Stop(flag_, std::max(share * seconds_left(), kLeast_s)) : *this;
  }

  /// Shortest limit that after_share() sets: long enough to look at the clock once.
  static constexpr double kLeast_s = 1e-4;

 private:
  const std::atomic<bool>* flag_ = nullptr;
  std::optional<Clock::time_point> at_;
};

/// Divides the time until a stop among tasks that begin one after the other on several threads. Each task gets an equal
/// part of the remaining time, so that later tasks benefit from time that earlier ones did not use.
class TimeShares {
 public:
  /// @param jobs see files::thread_count().
  TimeShares(Stop whole, int tasks, int jobs)
      : whole_(whole), left_(tasks), threads_(files::thread_count(jobs)) {}

  /// Returns the stop for the task that begins now.
  Stop next() {
    const std::lock_guard<std::mutex> lock(mutex_);
    const int tasks = std::max(left_--, 1);
    return whole_.after_share(static_cast<double>(std::min(threads_, tasks)) / tasks);
  }

 private:
  std::mutex mutex_;
  Stop whole_;
  int left_, threads_;
};

}  // namespace swarmcert::lipschitz
