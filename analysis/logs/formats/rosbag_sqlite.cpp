/// @file rosbag2 in SQLite (`.db3`), the default of ROS 2 before Iron.
///
/// Reads topics as read_mcap() does. Message definitions are taken from the database if it has them (since Iron), else
/// built in; topics of other types are listed in `left_out`. Single messages compressed with zstd are
/// supported.
///
/// The database is read from memory: nothing is written, locked or created. What a recorder that was killed has left in
/// the journal beside it (-wal) is read, and counted in `health.repaired`; a journal of another form is listed in
/// `left_out`. Views, triggers, virtual tables and computed columns are refused; work and sizes are limited by the size
/// of the file. Reading stops at a damaged page; everything before it is kept.
#include <fmt/core.h>
#include <sqlite3.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>

#include "analysis/logs/formats/bytes.h"
#include "analysis/logs/formats/decompress.h"
#include "analysis/logs/formats/formats.h"
#include "analysis/logs/formats/ros_topic.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"

namespace swarmcert::logs {
namespace {

constexpr std::string_view kSqliteMagic("SQLite format 3\0", 16);
constexpr std::size_t kMostTopics = std::size_t{1} << 16;

/// An in-memory database with an untrusted schema.
class Database {
 public:
  /// @param bytes must outlive this object; the two bytes that announce a write-ahead log are changed
  Database(std::string& bytes, const std::string& path) : path_(path) {
    // A database in write-ahead log mode cannot be opened from memory unless its header says otherwise.
    if (bytes.size() > 19) bytes[18] = bytes[19] = 1;
    sqlite3* raw = nullptr;
    const int opened =
        sqlite3_open_v2(":memory:", &raw, SQLITE_OPEN_READWRITE | SQLITE_OPEN_NOMUTEX, nullptr);
    handle_.reset(raw);
    if (opened != SQLITE_OK) refuse("cannot be opened");
    for (const int option :
         {SQLITE_DBCONFIG_ENABLE_TRIGGER, SQLITE_DBCONFIG_ENABLE_VIEW, SQLITE_DBCONFIG_TRUSTED_SCHEMA})
      sqlite3_db_config(raw, option, 0, nullptr);
    sqlite3_db_config(raw, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
    constexpr int kLargestValue_bytes = 1 << 26;
    sqlite3_limit(raw, SQLITE_LIMIT_LENGTH, kLargestValue_bytes);
    const auto size = static_cast<sqlite3_int64>(bytes.size());
    auto* const data = reinterpret_cast<unsigned char*>(bytes.data());
    if (sqlite3_deserialize(raw, "main", data, size, size, SQLITE_DESERIALIZE_READONLY) != SQLITE_OK)
      refuse("cannot be opened");
    instructions_left_ = kLeastInstructions + kInstructionsPerByte * bytes.size();
    sqlite3_progress_handler(raw, kStep_instructions, &Database::stops, this);
  }

  sqlite3* handle() const { return handle_.get(); }

  [[noreturn]] void refuse(const std::string& what) const {
    throw files::InputError({path_, "", "", "", what, files::kCopyAgain});
  }

 private:
  struct Close {
    void operator()(sqlite3* handle) const { sqlite3_close(handle); }
  };
  static constexpr int kStep_instructions = 10000;
  static constexpr std::size_t kLeastInstructions = 10'000'000, kInstructionsPerByte = 100;

  /// Aborts queries on damaged pages, which can form a tree that takes forever to traverse.
  static int stops(void* self) {
    std::size_t& left = static_cast<Database*>(self)->instructions_left_;
    left -= std::min<std::size_t>(left, kStep_instructions);
    return left == 0 ? 1 : 0;
  }

  const std::string path_;
  std::unique_ptr<sqlite3, Close> handle_;
  std::size_t instructions_left_ = 0;
};

/// The rows of a query.
class Rows {
 public:
  Rows(const Database& database, const std::string& query) {
    sqlite3_stmt* raw = nullptr;
    if (sqlite3_prepare_v2(database.handle(), query.c_str(), -1, &raw, nullptr) == SQLITE_OK)
      statement_.reset(raw);
  }

  bool is_prepared() const { return statement_ != nullptr; }
  /// Advances to the next row. Returns false at the end and if a row cannot be read.
  bool next() {
    if (!statement_) return false;
    const int result = sqlite3_step(statement_.get());
    is_damaged_ = result != SQLITE_ROW && result != SQLITE_DONE;
    return result == SQLITE_ROW;
  }
  bool is_damaged() const { return is_damaged_; }
  std::int64_t integer(int column) const { return sqlite3_column_int64(statement_.get(), column); }
  /// The result is valid until the next row.
  std::string_view bytes(int column) const {
    const void* const data = sqlite3_column_blob(statement_.get(), column);
    const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column));
    return data == nullptr ? std::string_view() : std::string_view(static_cast<const char*>(data), size);
  }

 private:
  struct Finalize {
    void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
  };
  std::unique_ptr<sqlite3_stmt, Finalize> statement_;
  bool is_damaged_ = false;
};

/// Copies the pages that were committed to a write-ahead log into its database, as SQLite does: frames with the salts
/// of the log's head and right checksums, up to the last that ends a transaction. Returns their number.
/// https://www.sqlite.org/fileformat2.html#the_write_ahead_log
std::size_t apply_journal(std::string_view journal, std::string& bytes) {
  constexpr std::size_t kHead_bytes = 32, kFrameHead_bytes = 24, kSummedOfHead_bytes = 24,
                        kSummedOfFrame_bytes = 8;
  if (journal.size() < kHead_bytes || bytes.size() < kHead_bytes) return 0;
  const auto stored = [&](std::size_t at) { return *integer_at<std::uint32_t>(journal, at); };
  const auto number = [&](std::size_t at) { return __builtin_bswap32(stored(at)); };
  const std::size_t page_bytes = number(8), frame_bytes = kFrameHead_bytes + page_bytes;
  const bool is_swapped = (number(0) & 1) != 0;  // byte order of the words that are summed
  std::uint32_t first = 0, second = 0;
  const auto add = [&](std::size_t from, std::size_t size) {
    for (std::size_t at = from; at < from + size; at += 8) {
      first += (is_swapped ? number(at) : stored(at)) + second;
      second += (is_swapped ? number(at + 4) : stored(at + 4)) + first;
    }
  };
  const auto has_sum = [&](std::size_t at) { return number(at) == first && number(at + 4) == second; };
  add(0, kSummedOfHead_bytes);
  if (page_bytes < 512 || page_bytes > 65536 || page_bytes % 8 != 0 || !has_sum(24)) return 0;
  std::size_t committed = 0, pages = 0;
  for (std::size_t at = kHead_bytes; journal.size() - at >= frame_bytes; at += frame_bytes) {
    add(at, kSummedOfFrame_bytes);
    add(at + kFrameHead_bytes, page_bytes);
    if (journal.substr(at + 8, 8) != journal.substr(16, 8) || !has_sum(at + 16)) break;
    if (number(at + 4) == 0) continue;
    committed = (at - kHead_bytes) / frame_bytes + 1;
    pages = number(at + 4);
  }
  if (committed == 0 || pages * page_bytes > bytes.size() + journal.size()) return 0;
  bytes.resize(pages * page_bytes);
  for (std::size_t i = 0; i < committed; ++i) {
    const std::size_t at = kHead_bytes + i * frame_bytes, page = number(at);
    if (page > 0 && page <= pages)
      bytes.replace((page - 1) * page_bytes, page_bytes, journal.substr(at + kFrameHead_bytes, page_bytes));
  }
  return committed;
}

/// Truncates a file to whole pages, because SQLite would pad the last page with zeros. Returns true if it was cut.
bool cut_to_whole_pages(std::string& bytes) {
  constexpr std::size_t kHead_bytes = 100;
  if (bytes.size() < kHead_bytes) return true;
  const auto page_bytes = static_cast<std::size_t>(value_of(Scalar::kUint16, bytes.data() + 16, true));
  const std::size_t size = page_bytes == 1 ? 65536 : page_bytes;  // the format stores 65536 as 1
  const auto pages = static_cast<std::size_t>(value_of(Scalar::kUint32, bytes.data() + 28, true));
  if (size < 512) return false;  // damaged; SQLite refuses it
  const std::size_t whole = bytes.size() / size;
  const bool is_cut = bytes.size() % size != 0 || whole < pages;
  if (!is_cut || whole == 0) return is_cut;
  bytes.resize(whole * size);
  // SQLite refuses a file with fewer pages than its header states.
  for (std::size_t i = 0; i < 4; ++i) bytes[28 + i] = static_cast<char>(whole >> (24 - 8 * i));
  return is_cut;
}

class RosbagReader {
 public:
  /// @param bytes must outlive this object
  RosbagReader(std::string& bytes, const std::string& path)
      : is_cut_(cut_to_whole_pages(bytes)), database_(bytes, path) {
    log_.path = path;
    log_.format = "rosbag2 sqlite";
    log_.health.truncated = is_cut_;
    bytes_left_ = bytes.size();
    decompression_left_ = decompression_limit(bytes.size());
  }

  RawLog read() {
    demand_table("topics");
    demand_table("messages");
    if (is_plain_table("message_definitions")) read_definitions();
    read_topics();
    read_messages();
    finish();
    return std::move(log_);
  }

 private:
  struct Definition {
    std::string encoding, text;
  };

  /// Returns true for an ordinary table. Views, virtual tables and computed columns could execute anything.
  bool is_plain_table(const std::string& name) {
    Rows table(database_, "SELECT rootpage FROM sqlite_schema WHERE type='table' AND name='" + name + "'");
    if (!table.next() || table.integer(0) <= 0) return false;
    Rows columns(database_, "PRAGMA main.table_xinfo(" + name + ")");
    int count = 0;
    for (; columns.next(); ++count)
      if (columns.integer(6) != 0) return false;  // hidden: computed
    return count > 0;
  }

  [[noreturn]] void refuse_table(const std::string& name, const std::string& what) const {
    throw files::InputError({log_.path, "", "table", files::in_quotes(name), what,
                             "this SQLite database is not a rosbag2 log, or it is damaged"});
  }
  void demand_table(const std::string& name) {
    if (!is_plain_table(name)) refuse_table(name, "is missing or cannot be read");
  }

  void read_definitions() {
    Rows rows(database_,
              "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions NOT INDEXED");
    while (rows.next() && definitions_.size() < kMostTopics) {
      const std::string_view text = rows.bytes(2);
      if (text.size() <= kLongestDefinition_bytes && take_bytes(text.size() + 1))
        definitions_.emplace(rows.bytes(0), Definition{std::string(rows.bytes(1)), std::string(text)});
    }
    if (rows.is_damaged()) ++log_.health.damaged_blocks;
  }

  /// Returns false once more bytes have been read than the file has, i.e. if its pages form cycles.
  bool take_bytes(std::size_t count) {
    if (count > bytes_left_) return false;
    bytes_left_ -= count;
    return true;
  }

  void read_topics() {
    Rows rows(database_, "SELECT id, name, type, serialization_format FROM topics NOT INDEXED");
    if (!rows.is_prepared()) refuse_table("topics", "does not have the columns of a rosbag2");
    while (rows.next() && topics_.size() < kMostTopics) {
      const std::string type(rows.bytes(2).substr(0, 256));
      const auto definition = definitions_.find(type);
      const bool has_text = definition != definitions_.end() && definition->second.encoding == "ros2msg";
      topics_.emplace(rows.integer(0),
                      found_topic(std::string(rows.bytes(1).substr(0, 1024)), std::string(rows.bytes(3)),
                                  type, has_text ? std::string_view(definition->second.text) : "", budget_));
    }
    if (rows.is_damaged()) ++log_.health.damaged_blocks;
  }

  void read_messages() {
    // In file order: sorting would need the same amount of memory again.
    Rows rows(database_, "SELECT topic_id, timestamp, data FROM messages NOT INDEXED");
    if (!rows.is_prepared()) refuse_table("messages", "does not have the columns of a rosbag2");
    while (rows.next()) {
      const std::string_view data = rows.bytes(2);
      if (!take_bytes(data.size() + 1)) {
        ++log_.health.damaged_blocks;
        return;
      }
      take_message(rows.integer(0), rows.integer(1), data);
    }
    if (rows.is_damaged()) {
      ++log_.health.damaged_blocks;
      log_.health.truncated = true;
    }
  }

  void take_message(std::int64_t id, std::int64_t time_ns, std::string_view data) {
    const auto found = topics_.find(id);
    if (found == topics_.end()) {
      ++without_topic_;
      return;
    }
    FoundTopic& topic = found->second;
    if (!topic.topic) {
      ++topic.lost;
      return;
    }
    const double time_s = static_cast<double>(time_ns) / 1e9;
    if (!looks_like_zstd(data)) {
      topic.topic->add(time_s, data);
      return;
    }
    const Decompressed message = decompress(Compression::kZstd, data, decompression_left_);
    decompression_left_ -= message.bytes.size();
    if (message.is_whole)
      topic.topic->add(time_s, message.bytes);
    else
      ++log_.health.damaged_blocks;
  }

  void finish() {
    for (auto& [id, topic] : topics_) topic.move_to(log_, fmt::format("topic {}", id));
    number_instances(log_);
    if (without_topic_ > 0)
      log_.left_out.push_back(
          {"messages without topic", "the file lost the rows that name their topics", without_topic_});
  }

  const bool is_cut_;
  Database database_;
  RawLog log_;
  RosBudget budget_;
  std::size_t bytes_left_ = 0, decompression_left_ = 0, without_topic_ = 0;
  std::map<std::string, Definition> definitions_;
  std::map<std::int64_t, FoundTopic> topics_;
};

}  // namespace

bool looks_like_rosbag_sqlite(std::string_view head) {
  return head.substr(0, kSqliteMagic.size()) == kSqliteMagic;
}

RawLog read_rosbag_sqlite(std::string& bytes, const std::string& path) {
  if (!looks_like_rosbag_sqlite(bytes))
    refuse_at(path, 0, "magic number", "", "is not that of an SQLite database", "is this a rosbag?");
  const std::string journal_path = path + "-wal";
  std::error_code error;
  if (std::filesystem::file_size(journal_path, error) == 0 || error) return RosbagReader(bytes, path).read();
  const std::size_t pages = apply_journal(files::read_file(journal_path, kLargestLog_bytes), bytes);
  RawLog log = RosbagReader(bytes, path).read();
  log.health.repaired.journal_pages = pages;
  log.health.truncated |= pages == 0;
  if (pages == 0)
    log.left_out.push_back({journal_path, "it is no journal of this bag that holds whole transactions", 0});
  return log;
}

}  // namespace swarmcert::logs
