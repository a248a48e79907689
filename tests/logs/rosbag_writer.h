/// @file Creates rosbag2 databases in memory.
#pragma once

#include <sqlite3.h>

#include <stdexcept>
#include <string>

#include "logs/cdr_writer.h"

namespace swarmcert::tests {

/// Returns the bytes of the database created by `statements`.
inline std::string sqlite_bytes(const std::string& statements) {
  sqlite3* database = nullptr;
  sqlite3_open(":memory:", &database);
  char* fault = nullptr;
  if (sqlite3_exec(database, statements.c_str(), nullptr, nullptr, &fault) != SQLITE_OK)
    throw std::logic_error(fault);
  sqlite3_int64 size = 0;
  unsigned char* const data = sqlite3_serialize(database, "main", &size, 0);
  const std::string bytes(reinterpret_cast<const char*>(data), static_cast<std::size_t>(size));
  sqlite3_free(data);
  sqlite3_close(database);
  return bytes;
}

inline std::string hex_literal(const std::string& bytes) {
  std::string text = "x'";
  for (const char c : bytes) {
    text += "0123456789abcdef"[static_cast<unsigned char>(c) >> 4];
    text += "0123456789abcdef"[static_cast<unsigned char>(c) & 15];
  }
  return text + "'";
}

/// Uses pages of 512 bytes, so that small files have several.
inline std::string rosbag_tables() {
  return "PRAGMA page_size=512;CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT "
         "NULL, serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);CREATE TABLE "
         "messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data BLOB "
         "NOT NULL);CREATE INDEX timestamp_idx ON messages (timestamp ASC);";
}
inline std::string rosbag_topic(int id, const std::string& name, const std::string& type,
                                const std::string& encoding = "cdr") {
  return "INSERT INTO topics VALUES(" + std::to_string(id) + ",'" + name + "','" + type + "','" + encoding +
         "','');";
}
inline std::string rosbag_message(int topic, long time_ns, const std::string& data) {
  return "INSERT INTO messages(topic_id,timestamp,data) VALUES(" + std::to_string(topic) + "," +
         std::to_string(time_ns) + "," + hex_literal(data) + ");";
}
/// Returns poses whose x counts them, one every 10 ms starting at 1 s.
inline std::string rosbag_poses(int first, int last) {
  std::string statements;
  for (int k = first; k < last; ++k)
    statements += rosbag_message(1, 1'000'000'000L + 10'000'000L * k, cdr_pose(k, 2, 3));
  return statements;
}
inline std::string small_rosbag() {
  return sqlite_bytes(rosbag_tables() + rosbag_topic(1, "/cf1/pose", "geometry_msgs/msg/PoseStamped") +
                      rosbag_poses(0, 20));
}

}  // namespace swarmcert::tests
