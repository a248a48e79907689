/// @file Logs that were read are kept, so that a command which goes through its flights many times parses each once.
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

/// Safe to use from several threads. What was not asked for the longest goes first when the memory is full.
class LogCache {
 public:
  /// Six hours at 100 Hz.
  static constexpr std::size_t kMost_bytes = std::size_t{900} << 20;

  /// @param hover_multiples  logs are changed by logs::use_hover_multiples().
  explicit LogCache(bool hover_multiples, std::size_t most_bytes = kMost_bytes)
      : hover_multiples_(hover_multiples), most_bytes_(most_bytes) {}

  /// The log, from memory or read. @throws files::InputError as logs::read_log().
  std::shared_ptr<const CachedLog> log(const std::string& path, const logs::SignalMap& map);

  std::size_t held_bytes() const;
  std::size_t reads() const;  ///< files that were parsed so far

 private:
  struct Entry {
    std::shared_ptr<const CachedLog> log;
    std::list<std::string>::iterator age;
  };
  const bool hover_multiples_;
  const std::size_t most_bytes_;
  mutable std::mutex mutex_;
  std::map<std::string, Entry> entries_;
  std::list<std::string> ages_;  ///< paths, the latest used first
  std::size_t held_bytes_ = 0, reads_ = 0;
};

}  // namespace swarmcert::residuals
