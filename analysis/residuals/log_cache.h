/// @file Caches logs, so that a command that goes through its flights several times parses each log once.
#pragma once

#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "analysis/logs/log.h"
#include "analysis/logs/plausibility.h"
#include "analysis/logs/signals.h"

namespace swarmcert::residuals {

struct CachedLog {
  logs::Log log;
  std::vector<logs::Doubt> doubts;  ///< logs::doubts_of(log)
};

/// A thread-safe cache of logs. The least recently used logs are evicted when the memory is full.
class LogCache {
 public:
  /// Corresponds to about six hours at 100 Hz.
  static constexpr std::size_t kMost_bytes = std::size_t{900} << 20;

  /// @param hover_multiples  apply logs::use_hover_multiples() to the logs
  explicit LogCache(bool hover_multiples, std::size_t most_bytes = kMost_bytes)
      : hover_multiples_(hover_multiples), most_bytes_(most_bytes) {}

  /// Returns the log from the cache, or reads it.
  /// @throws files::InputError as logs::read_log() does.
  std::shared_ptr<const CachedLog> log(const std::string& path, const logs::SignalMap& map);

  std::size_t held_bytes() const;
  std::size_t reads() const;  ///< number of files parsed so far

 private:
  struct Entry {
    std::shared_ptr<const CachedLog> log;
    std::list<std::string>::iterator age;
  };
  const bool hover_multiples_;
  const std::size_t most_bytes_;
  mutable std::mutex mutex_;
  std::map<std::string, Entry> entries_;
  std::list<std::string> ages_;  ///< paths, most recently used first
  std::size_t held_bytes_ = 0, reads_ = 0;
};

}  // namespace swarmcert::residuals
