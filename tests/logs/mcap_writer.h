/// @file Writes MCAP files byte by byte, so that tests can damage them.
#pragma once

#include <cstdint>
#include <string>

#include "logs/cdr_writer.h"

namespace swarmcert::tests {

inline std::string mcap_magic() { return "\x89MCAP0\r\n"; }
inline std::string mcap_text(const std::string& text) {
  return bytes_of(static_cast<std::uint32_t>(text.size())) + text;
}
inline std::string mcap_record(unsigned char code, const std::string& content) {
  return static_cast<char>(code) + bytes_of(static_cast<std::uint64_t>(content.size())) + content;
}
inline std::string mcap_header() { return mcap_record(0x01, mcap_text("ros2") + mcap_text("test")); }
inline std::string mcap_schema(std::uint16_t id, const std::string& name, const std::string& text,
                               const std::string& encoding = "ros2msg") {
  return mcap_record(0x03, bytes_of(id) + mcap_text(name) + mcap_text(encoding) + mcap_text(text));
}
inline std::string mcap_channel(std::uint16_t id, std::uint16_t schema, const std::string& topic,
                                const std::string& encoding = "cdr") {
  return mcap_record(0x04, bytes_of(id) + bytes_of(schema) + mcap_text(topic) + mcap_text(encoding) +
                               bytes_of(std::uint32_t{0}));
}
inline std::string mcap_message(std::uint16_t channel, std::uint64_t time_ns, const std::string& data) {
  return mcap_record(
      0x05, bytes_of(channel) + bytes_of(std::uint32_t{0}) + bytes_of(time_ns) + bytes_of(time_ns) + data);
}
inline std::string mcap_chunk(const std::string& records, const std::string& compression,
                              const std::string& compressed) {
  return mcap_record(0x06, bytes_of(std::uint64_t{0}) + bytes_of(std::uint64_t{0}) +
                               bytes_of(static_cast<std::uint64_t>(records.size())) +
                               bytes_of(crc32_of(records)) + mcap_text(compression) +
                               bytes_of(static_cast<std::uint64_t>(compressed.size())) + compressed);
}
inline std::string mcap_chunk(const std::string& records) { return mcap_chunk(records, "", records); }
/// Returns everything from the end of the data to the end of the file.
/// @param data everything before it
inline std::string mcap_end(const std::string& data) {
  return mcap_record(0x0F, bytes_of(crc32_of(data))) + mcap_record(0x02, std::string(20, '\0')) +
         mcap_magic();
}

inline std::string mcap_pose_definitions() {
  return mcap_schema(1, "geometry_msgs/msg/PoseStamped", pose_definition()) + mcap_channel(1, 1, "/cf1/pose");
}
/// Returns poses whose x counts them, one every 10 ms starting at 1 s.
inline std::string mcap_poses(int first, int last) {
  std::string records;
  for (int k = first; k < last; ++k)
    records += mcap_message(1, 1'000'000'000 + 10'000'000 * static_cast<std::uint64_t>(k), cdr_pose(k, 2, 3));
  return records;
}
/// Returns twenty poses: four outside chunks, the others in two chunks.
inline std::string small_mcap() {
  const std::string data = mcap_magic() + mcap_header() + mcap_pose_definitions() + mcap_poses(0, 4) +
                           mcap_chunk(mcap_pose_definitions() + mcap_poses(4, 12)) +
                           mcap_chunk(mcap_poses(12, 20));
  return data + mcap_end(data);
}

}  // namespace swarmcert::tests
