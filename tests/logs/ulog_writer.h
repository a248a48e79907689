/// @file Writes ULog files byte by byte, so that tests can damage them.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "analysis/log_writer.h"

namespace swarmcert::tests {

/// Returns a message of `type`: size, type, body.
inline std::string ulog_message(char type, const std::string& body) {
  return bytes_of(static_cast<std::uint16_t>(body.size())) + type + body;
}

inline std::string ulog_head(int version = 1) {
  return std::string("ULog\x01\x12\x35") + static_cast<char>(version) + bytes_of(std::uint64_t{5'000'000});
}

inline std::string ulog_flags(std::uint8_t compatible, std::uint8_t incompatible,
                              const std::vector<std::uint64_t>& offsets = {}) {
  std::string body(1, static_cast<char>(compatible));
  body += std::string(7, '\0') + static_cast<char>(incompatible) + std::string(7, '\0');
  for (std::size_t i = 0; i < 3; ++i) body += bytes_of(i < offsets.size() ? offsets[i] : std::uint64_t{0});
  return ulog_message('B', body);
}

inline std::string ulog_format(const std::string& definition) { return ulog_message('F', definition); }

/// Returns an information or parameter ('P') message: key "type name" and value.
inline std::string ulog_keyed(char type, const std::string& key, const std::string& value) {
  return ulog_message(type, static_cast<char>(key.size()) + key + value);
}

inline std::string ulog_subscription(std::uint16_t id, const std::string& topic, std::uint8_t instance = 0) {
  return ulog_message('A', static_cast<char>(instance) + bytes_of(id) + topic);
}

/// @param fields what follows the timestamp
inline std::string ulog_record(std::uint16_t id, std::uint64_t time_us, const std::string& fields) {
  return ulog_message('D', bytes_of(id) + bytes_of(time_us) + fields);
}

/// Returns records of the topic "count" (id 7): `number` as float, one every 10 ms starting at 1 s.
inline std::string ulog_counts(int first, int last) {
  std::string bytes;
  for (int k = first; k < last; ++k)
    bytes +=
        ulog_record(7, 1'000'000 + 10'000 * static_cast<std::uint64_t>(k), bytes_of(static_cast<float>(k)));
  return bytes;
}

inline std::string ulog_count_definitions() {
  return ulog_format("count:uint64_t timestamp;float number;") + ulog_subscription(7, "count");
}

/// Returns twenty counts, with the other elements of a log between them.
inline std::string small_ulog() {
  return ulog_head() + ulog_flags(0, 0) + ulog_format("count:uint64_t timestamp;float number;") +
         ulog_format("part:int16_t[2] pair;uint8_t[2] _padding0;char[4] word;") +
         ulog_format("whole:uint64_t timestamp;part[2] parts;double large;bool flag;uint8_t[7] _padding0;") +
         ulog_keyed('I', "char[3] sys_name", "PX4") +
         ulog_keyed('I', "uint32_t ver", bytes_of(std::uint32_t{7})) +
         ulog_keyed('P', "float MASS", bytes_of(0.5f)) +
         ulog_keyed('P', "int32_t ROTORS", bytes_of(std::int32_t{4})) +
         ulog_message('Q', "\2" + ulog_keyed('P', "float MASS", bytes_of(0.25f)).substr(3)) +
         ulog_subscription(7, "count") + ulog_subscription(8, "whole", 1) + ulog_counts(0, 10) +
         ulog_record(8, 1'100'000,
                     bytes_of(std::int16_t{1}) + bytes_of(std::int16_t{-2}) + std::string("\0\0ab\0\0", 6) +
                         bytes_of(std::int16_t{3}) + bytes_of(std::int16_t{-4}) + std::string("\0\0cdef", 6) +
                         bytes_of(1e300) + '\1') +
         ulog_message('L', "6" + bytes_of(std::uint64_t{1'100'000}) + "Takeoff detected") +
         ulog_message('O', bytes_of(std::uint16_t{250})) +
         ulog_message('S', "\x2F\x73\x13\x20\x25\x0C\xBB\x12") +
         ulog_keyed('P', "float MASS", bytes_of(0.75f)) + ulog_counts(10, 20);
}

}  // namespace swarmcert::tests
