/// @file Writes ArduPilot dataflash logs byte by byte, so that tests can damage them.
#pragma once

#include <cstdint>
#include <string>

#include "analysis/log_writer.h"

namespace swarmcert::tests {

inline std::string fixed_text(std::string text, std::size_t size) {
  text.resize(size, '\0');
  return text;
}
inline std::string dataflash_message(std::uint8_t id, const std::string& body) {
  return "\xA3\x95" + std::string(1, static_cast<char>(id)) + body;
}
inline std::string dataflash_format(std::uint8_t id, std::uint8_t bytes, const std::string& name,
                                    const std::string& letters, const std::string& names) {
  return dataflash_message(128, std::string(1, static_cast<char>(id)) + static_cast<char>(bytes) +
                                    fixed_text(name, 4) + fixed_text(letters, 16) + fixed_text(names, 64));
}
inline std::string dataflash_definitions() {
  return dataflash_format(128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns") +
         dataflash_format(200, 44, "FMTU", "QBNN", "TimeUS,FmtType,UnitIds,MultIds") +
         dataflash_format(201, 76, "UNIT", "QbZ", "TimeUS,Id,Label") +
         dataflash_format(202, 20, "MULT", "Qbd", "TimeUS,Id,Mult") +
         dataflash_format(203, 35, "PARM", "QNff", "TimeUS,Name,Value,Default") +
         dataflash_format(204, 75, "MSG", "QZ", "TimeUS,Message") +
         dataflash_format(10, 15, "CNT", "Qf", "TimeUS,Number") +
         dataflash_format(11, 20, "XKF1", "QBff", "TimeUS,C,VN,PD") +
         dataflash_format(12, 15, "ATT", "QcC", "TimeUS,Roll,Yaw");
}
inline std::string dataflash_unit(char id, const std::string& label) {
  return dataflash_message(201, bytes_of(std::uint64_t{1}) + id + fixed_text(label, 64));
}
inline std::string dataflash_multiplier(char id, double value) {
  return dataflash_message(202, bytes_of(std::uint64_t{1}) + id + bytes_of(value));
}
inline std::string dataflash_units(std::uint8_t id, const std::string& units,
                                   const std::string& multipliers) {
  return dataflash_message(200, bytes_of(std::uint64_t{1}) + static_cast<char>(id) + fixed_text(units, 16) +
                                    fixed_text(multipliers, 16));
}
inline std::string dataflash_parameter(const std::string& name, float value, float standard) {
  return dataflash_message(
      203, bytes_of(std::uint64_t{2'000'000}) + fixed_text(name, 16) + bytes_of(value) + bytes_of(standard));
}
/// Returns counts as floats, one every 10 ms starting at 1 s.
inline std::string dataflash_counts(int first, int last) {
  std::string bytes;
  for (int k = first; k < last; ++k)
    bytes += dataflash_message(
        10, bytes_of(1'000'000 + 10'000 * static_cast<std::uint64_t>(k)) + bytes_of(static_cast<float>(k)));
  return bytes;
}
inline std::string dataflash_state(std::uint8_t core, float north_velocity, float down) {
  return dataflash_message(11, bytes_of(std::uint64_t{3'000'000}) + static_cast<char>(core) +
                                   bytes_of(north_velocity) + bytes_of(down));
}
inline std::string small_dataflash() {
  return dataflash_definitions() + dataflash_unit('m', "m") + dataflash_unit('n', "m/s") +
         dataflash_unit('s', "s") + dataflash_unit('d', "deg") + dataflash_unit('#', "instance") +
         dataflash_multiplier('F', 1e-6) + dataflash_multiplier('B', 1e-2) + dataflash_multiplier('0', 1) +
         dataflash_multiplier('-', 0) + dataflash_units(11, "s#nm", "F-0B") +
         dataflash_units(12, "sdd", "FBB") + dataflash_parameter("MOT_THST_HOVER", 0.35f, 0.25f) +
         dataflash_counts(0, 10) + dataflash_state(0, 1.5f, -200) + dataflash_state(1, 2.5f, -300) +
         dataflash_message(12, bytes_of(std::uint64_t{3'100'000}) + bytes_of(std::int16_t{-1234}) +
                                   bytes_of(std::uint16_t{35999})) +
         dataflash_message(204, bytes_of(std::uint64_t{3'200'000}) + fixed_text("ArduCopter V4", 64)) +
         dataflash_parameter("MOT_THST_HOVER", 0.5f, 0.25f) + dataflash_counts(10, 20);
}

}  // namespace swarmcert::tests
