/// @file Writes serialized ROS 2 messages (CDR) byte by byte.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>

#include "analysis/log_writer.h"

namespace swarmcert::tests {

class CdrWriter {
 public:
  explicit CdrWriter(bool is_big_endian = false, bool is_version_2 = false)
      : is_big_endian_(is_big_endian), is_version_2_(is_version_2) {}

  template <typename Number>
  CdrWriter& number(Number value) {
    const std::size_t alignment = std::min(sizeof value, std::size_t{is_version_2_ ? 4u : 8u});
    while (data_.size() % alignment != 0) data_ += '\0';
    std::string bytes = bytes_of(value);
    if (is_big_endian_) std::reverse(bytes.begin(), bytes.end());
    data_ += bytes;
    return *this;
  }
  template <typename... Numbers>
  CdrWriter& doubles(Numbers... values) {
    (number(static_cast<double>(values)), ...);
    return *this;
  }
  CdrWriter& count(std::size_t n) { return number(static_cast<std::uint32_t>(n)); }
  CdrWriter& text(const std::string& text) {
    count(text.size() + 1);
    data_ += text + '\0';
    return *this;
  }
  CdrWriter& header(std::int32_t sec, std::uint32_t nanosec, const std::string& frame) {
    return number(sec).number(nanosec).text(frame);
  }
  std::string message() const {
    std::string head(4, '\0');
    head[1] = static_cast<char>((is_version_2_ ? 6 : 0) + (is_big_endian_ ? 0 : 1));
    return head + data_;
  }

 private:
  bool is_big_endian_, is_version_2_;
  std::string data_;
};

/// Returns a geometry_msgs/PoseStamped at x, y, z.
inline std::string cdr_pose(double x, double y, double z, bool is_big_endian = false) {
  return CdrWriter(is_big_endian).header(5, 250'000'000, "world").doubles(x, y, z, 0, 0, 0, 1).message();
}

inline const char* pose_definition() {
  return "std_msgs/Header header\ngeometry_msgs/Pose pose\n"
         "================\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
         "================\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
         "================\nMSG: geometry_msgs/Pose\nPoint position\nQuaternion orientation\n"
         "================\nMSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n"
         "================\nMSG: geometry_msgs/Quaternion\nfloat64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w "
         "1\n";
}

}  // namespace swarmcert::tests
