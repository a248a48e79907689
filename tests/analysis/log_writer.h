/// @file Writes flight logs byte by byte, so that tests can damage them.
#pragma once

#include <zlib.h>

#include <cstdint>
#include <string>
#include <vector>

namespace swarmcert::tests {

template <typename Number>
std::string bytes_of(Number number) {
  return {reinterpret_cast<const char*>(&number), sizeof number};  // the tests run on little-endian machines
}

inline std::uint32_t crc32_of(const std::string& bytes) {
  return static_cast<std::uint32_t>(
      ::crc32(0, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(bytes.size())));
}

/// The checksum as stored by the flown firmware: the bitwise NOT of CRC-32.
inline std::string stored_checksum(const std::string& bytes) { return bytes_of(~crc32_of(bytes)); }

/// "tick", position and velocity in millimetres.
inline const std::vector<std::string>& small_tokens() {
  static const std::vector<std::string> tokens = {
      "tick(I)",
      "stateEstimateZ.x(h)",
      "stateEstimateZ.y(h)",
      "stateEstimateZ.z(h)",
      "stateEstimateZ.vx(h)",
      "stateEstimateZ.vy(h)",
      "stateEstimateZ.vz(h)",
  };
  return tokens;
}

inline std::string usd_header(const std::vector<std::string>& tokens = small_tokens()) {
  std::string header(1, static_cast<char>(tokens.size()));
  for (const std::string& token : tokens) header += token + ",";
  return header + stored_checksum(header);
}

/// x counts the records, so that tests see which of them were read.
inline std::string small_record(std::uint32_t tick_us, std::int16_t x_mm) {
  std::string record = bytes_of(tick_us) + bytes_of(x_mm);
  for (int i = 0; i < 5; ++i) record += bytes_of(std::int16_t{1});
  return record;
}

inline std::string usd_block(const std::vector<std::string>& records) {
  std::string block(1, static_cast<char>(records.size()));
  for (const std::string& record : records) block += record;
  return block + stored_checksum(block);
}

/// `blocks` blocks of two records, 10 ms apart, x = 0, 1, 2, ...
inline std::string small_usd(int blocks = 10) {
  std::string file = usd_header();
  for (int b = 0; b < blocks; ++b) {
    const int k = 2 * b;
    file += usd_block(
        {small_record(static_cast<std::uint32_t>(10000 * (k + 1)), static_cast<std::int16_t>(k)),
         small_record(static_cast<std::uint32_t>(10000 * (k + 2)), static_cast<std::int16_t>(k + 1))});
  }
  return file;
}

/// Version 1 or 2 with one event of floats x, y, z, vx, vy, vz; x = 0, 1, 2, ... metres.
inline std::string small_events(int version, int records = 20) {
  std::string file = "\xBC" + bytes_of(static_cast<std::uint16_t>(version)) + bytes_of(std::uint16_t{1});
  file += bytes_of(std::uint16_t{7}) + std::string("fixedFrequency") + '\0' + bytes_of(std::uint16_t{6});
  for (const char* name : {"x", "y", "z", "vx", "vy", "vz"})
    file += "stateEstimate." + std::string(name) + "(f)" + '\0';
  for (int k = 0; k < records; ++k) {
    file += bytes_of(std::uint16_t{7});
    file += version == 1 ? bytes_of(static_cast<std::uint32_t>(10 * (k + 1)))
                         : bytes_of(static_cast<std::uint64_t>(10000 * (k + 1)));
    file += bytes_of(static_cast<float>(k));
    for (int i = 0; i < 5; ++i) file += bytes_of(1.0f);
  }
  return file + bytes_of(crc32_of(file));
}

/// The small log as CSV, with the names of a columns.toml.
inline std::string small_csv(int records = 20) {
  std::string text = "t,px,py,pz,vx,vy,vz\n";
  for (int k = 0; k < records; ++k)
    text += std::to_string(0.01 * (k + 1)) + "," + std::to_string(k) + ",1,1,1,1,1\n";
  return text;
}

inline const char* small_columns() {
  return "schema = \"swarmcert/columns/1\"\n"
         "time = { column = \"t\", unit = \"s\" }\n"
         "position_x = { column = \"px\", unit = \"mm\", frame = \"world\" }\n"
         "position_y = { column = \"py\", unit = \"mm\" }\n"
         "position_z = { column = \"pz\", unit = \"mm\" }\n"
         "velocity_x = { column = \"vx\", unit = \"m/s\" }\n"
         "velocity_y = { column = \"vy\", unit = \"m/s\" }\n"
         "velocity_z = { column = \"vz\", unit = \"m/s\" }\n";
}

}  // namespace swarmcert::tests
