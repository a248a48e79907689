#include "analysis/residuals/log_cache.h"

#include "analysis/logs/hover_scale.h"
#include "analysis/logs/read_log.h"

namespace swarmcert::residuals {
namespace {

std::size_t bytes_of(const logs::Log& log) {
  std::size_t bytes = sizeof log + log.samples.capacity() * sizeof(logs::Sample);
  for (const std::string& channel : log.channels) bytes += sizeof channel + channel.capacity();
  for (const auto& [name, value] : log.parameters) bytes += sizeof value + sizeof name + name.capacity();
  return bytes;
}

}  // namespace

std::shared_ptr<const CachedLog> LogCache::log(const std::string& path, const logs::SignalMap& map) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto known = entries_.find(path);
    if (known != entries_.end()) {
      ages_.splice(ages_.begin(), ages_, known->second.age);
      return known->second.log;
    }
    ++reads_;
  }
  logs::Log read = logs::read_log(path, map);
  if (hover_multiples_) logs::use_hover_multiples(read);
  const std::size_t size = bytes_of(read);
  std::vector<logs::Doubt> doubts = logs::doubts_of(read);
  const auto log = std::make_shared<const CachedLog>(CachedLog{std::move(read), std::move(doubts)});
  const std::lock_guard<std::mutex> lock(mutex_);
  if (size > most_bytes_ || entries_.count(path) != 0) return log;
  while (held_bytes_ + size > most_bytes_) {
    held_bytes_ -= bytes_of(entries_.at(ages_.back()).log->log);
    entries_.erase(ages_.back());
    ages_.pop_back();
  }
  ages_.push_front(path);
  entries_[path] = {log, ages_.begin()};
  held_bytes_ += size;
  return log;
}

std::size_t LogCache::held_bytes() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return held_bytes_;
}

std::size_t LogCache::reads() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return reads_;
}

}  // namespace swarmcert::residuals
