#include <algorithm>
#include <limits>

#include "analysis/logs/formats/formats.h"

namespace swarmcert::logs {
namespace {

/// Appends the records of `more` to `topic`; columns that only one of them has are NaN in the other.
void append(RawTopic& topic, RawTopic& more) {
  constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();
  const std::size_t before = topic.time_s.size();
  topic.time_s.insert(topic.time_s.end(), more.time_s.begin(), more.time_s.end());
  for (RawColumn& column : more.columns) {
    const auto same = std::find_if(topic.columns.begin(), topic.columns.end(),
                                   [&](const RawColumn& candidate) { return candidate.name == column.name; });
    if (same == topic.columns.end()) {
      column.values.insert(column.values.begin(), before, kMissing);
      topic.columns.push_back(std::move(column));
    } else {
      same->values.insert(same->values.end(), column.values.begin(), column.values.end());
    }
  }
  for (RawColumn& column : topic.columns) column.values.resize(topic.time_s.size(), kMissing);
  topic.texts.insert(more.texts.begin(), more.texts.end());
}

void append(LogHealth& health, const LogHealth& more) {
  health.records += more.records;
  health.damaged_blocks += more.damaged_blocks;
  health.skipped_bytes += more.skipped_bytes;
  health.bytes += more.bytes;
  health.truncated |= more.truncated;
  health.checksum_failed |= more.checksum_failed;
}

}  // namespace

void append(RawLog& log, RawLog&& more) {
  for (RawTopic& topic : more.topics) {
    const auto same = std::find_if(log.topics.begin(), log.topics.end(), [&](const RawTopic& candidate) {
      return candidate.name == topic.name && candidate.instance == topic.instance;
    });
    if (same == log.topics.end())
      log.topics.push_back(std::move(topic));
    else
      append(*same, topic);
  }
  log.texts.insert(more.texts.begin(), more.texts.end());
  log.skipped.insert(log.skipped.end(), more.skipped.begin(), more.skipped.end());
  append(log.health, more.health);
}

}  // namespace swarmcert::logs
