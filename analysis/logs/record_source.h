/// @file Log files as streams of records: numbers under names, in the file's own units.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "analysis/logs/raw_log.h"
#include "nn/base/input_error.h"

namespace swarmcert::logs {

/// Receives a file's records one by one, so that a reader holds no more than one block of the file.
class RecordSink {
 public:
  virtual ~RecordSink() = default;
  /// @param names  of the columns, unique. The first is the time.
  virtual void begin(const std::vector<std::string>& names) = 0;
  /// @param values one per name; NaN where the file says nothing; valid during the call only.
  virtual void record(const std::vector<double>& values) = 0;
  /// After begin(): false where text in place of the number of `column` does no harm. Then record() gets NaN.
  virtual bool needs(std::size_t column) const = 0;
};

/// Old micro-SD format: u8 number of variables, that many "name(type)," tokens, u32 checksum; then blocks of u8 n,
/// n packed little-endian records, u32 checksum over both. The stored checksum is the bitwise NOT of CRC-32.
/// A block whose checksum fails is skipped: the reader looks for the next byte at which a sound block with a sensible
/// time starts.
/// @throws files::InputError if the header is damaged or names an unknown type, because then no record can be read.
void read_usd(std::istream& in, const std::string& path, RecordSink& sink, LogHealth& health);

/// Micro-SD formats with magic 0xBC, versions 1 (times in ms) and 2 (times in us); CRC-32 of all before ends the
/// file. Every record carries an event, and every event becomes a topic with its own times. Where no known event
/// follows, the reader looks for the next byte from which three records with increasing times follow each other.
/// @throws files::InputError as read_usd().
/// @return the version
int read_usd_events(std::istream& in, const std::string& path, RawLog& log);

/// Text: a header line, which may start with "#" and follow lines that do, and lines of as many cells, separated by the
/// first of comma, semicolon and tab that the header has. Cells are numbers, or empty; in columns that the sink does
/// not need, anything. Where no comma separates, commas are decimal points. Dates become seconds since 1970, times of
/// the day seconds since midnight.
/// @return what is wrong with the first damaged line
/// @throws files::InputError if the header is empty or has a name twice.
std::optional<files::InputFault> read_csv(std::istream& in, const std::string& path, RecordSink& sink,
                                          LogHealth& health);

}  // namespace swarmcert::logs
