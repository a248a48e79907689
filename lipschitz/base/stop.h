/// @file When work that could go on has to end, and how the time of a command is shared out.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <mutex>
#include <optional>

#include "nn/base/parallel.h"

namespace swarmcert::lipschitz {

/// A flag that a signal sets, a time, both or neither. Copies share the flag.
class Stop {
 public:
  using Clock = std::chrono::steady_clock;

  Stop() = default;  ///< never
  /// @param flag stays the caller's; null: none.
  /// @param seconds from now on; 0: no limit.
  explicit Stop(const std::atomic<bool>* flag, double seconds = 0) : flag_(flag) {
    // A limit beyond what the clock can count is none.
    constexpr double kLongest_s = 1e8;
    if (seconds > 0 && seconds < kLongest_s)
      at_ =
          Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  }

  bool is_cancelled() const { return flag_ != nullptr && *flag_; }
  bool is_out_of_time() const { return at_ && Clock::now() >= *at_; }
  bool now() const { return is_cancelled() || is_out_of_time(); }
  bool has_limit() const { return at_.has_value(); }

  /// Seconds until the limit, 0 once it has passed. Precondition: has_limit().
  double seconds_left() const {
    return std::max(0.0, std::chrono::duration<double>(*at_ - Clock::now()).count());
  }
  /// The same flag; the time, where there is a limit, after this share of what is left.
  Stop after_share(double share) const {
    return has_limit() ? Stop(flag_, std::max(share * seconds_left(), kLeast_s)) : *this;
  }

  /// What has no time left looks at the clock once and stops.
  static constexpr double kLeast_s = 1e-4;

 private:
  const std::atomic<bool>* flag_ = nullptr;
  std::optional<Clock::time_point> at_;
};

/// Shares out the time until a stop among tasks that begin one after the other on several threads: each gets an equal
/// part of what is left, so that what quick tasks do not need goes to those behind them.
class TimeShares {
 public:
  /// @param jobs see files::thread_count().
  TimeShares(Stop whole, int tasks, int jobs)
      : whole_(whole), left_(tasks), threads_(files::thread_count(jobs)) {}

  /// The stop of the task that begins now.
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
