/// @file Log files as streams of records: named numbers in the units of the file.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "analysis/logs/raw_log.h"
#include "nn/base/input_error.h"

namespace swarmcert::logs {

/// Receives the records of a file one by one, so that a reader holds at most one block of the file.
class RecordSink {
 public:
  virtual ~RecordSink() = default;
  /// @param names  of the columns, unique; the first is the time
  virtual void begin(const std::vector<std::string>& names) = 0;
  /// @param values one per name; NaN where the file has none; valid only during the call
  virtual void record(const std::vector<double>& values) = 0;
  /// Returns false if text instead of a number is acceptable in `column`; record() then gets NaN. Call after begin().
  virtual bool needs(std::size_t column) const = 0;
};

/// Reads the old micro-SD format: u8 number of variables, that many "name(type)," tokens, u32 checksum; then blocks of
/// u8 n, n packed little-endian records, u32 checksum over both. The stored checksum is the bitwise NOT of CRC-32. A
/// block with a wrong checksum is skipped: the reader searches for the next byte at which a valid block with a
/// plausible time starts.
/// @throws files::InputError if the header is damaged or names an unknown type, because then no record can be read.
void read_usd(std::istream& in, const std::string& path, RecordSink& sink, LogHealth& health);

/// Reads the micro-SD formats with magic 0xBC, versions 1 (times in ms) and 2 (times in us); the file ends with the
/// CRC-32 of everything before it. Each record belongs to an event, and each event becomes a topic with its own times.
/// If no known event follows, the reader searches for the next byte from which three records with increasing times
/// follow each other.
/// @throws files::InputError as read_usd() does.
/// @return the version
int read_usd_events(std::istream& in, const std::string& path, RawLog& log);

/// Reads text: a header line, which may start with "#" and follow comment lines starting with "#", and lines with the
/// same number of cells. The separator is the first of comma, semicolon, tab and blank that occurs in the header.
/// Cells are numbers or empty; cells that hold a list become columns name[0], name[1], ...; columns that the sink does
/// not need may hold anything. If the separator is not a comma, commas are decimal points. Dates become seconds since
/// 1970, times of day seconds since midnight.
/// @return what is wrong with the first damaged line
/// @throws files::InputError if the header is empty or contains a name twice.
std::optional<files::InputFault> read_csv(std::istream& in, const std::string& path, RecordSink& sink,
                                          LogHealth& health);

}  // namespace swarmcert::logs
