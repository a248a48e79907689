/// @file ArduPilot dataflash logs (`.bin`).
///
/// Reads a log. Topics are named after their message ("XKF1", "ATT", "RCOU", "BAT", "MOTB"); a field that the log
/// declares as the instance becomes RawTopic::instance. Times come from `TimeUS` or `TimeMS`. The multipliers of the
/// log (MULT) and those of the number types (centidegrees to degrees, 1e-7 degrees to degrees) are applied. Parameters
/// are the first values in PARM. MSG gives the messages. If no message follows, the reader searches for the next two
/// consecutive messages and counts the damaged place and the skipped bytes.
#include <fmt/core.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "analysis/logs/formats/bytes.h"
#include "analysis/logs/formats/formats.h"

namespace swarmcert::logs {
namespace {

constexpr std::size_t kDataflashHead_bytes = 3;  ///< of each message: two fixed bytes and the format

/// How a field type, a single letter, is stored.
struct FieldType {
  std::optional<Scalar> number;  ///< empty: text or a 16-bit float
  std::size_t bytes = 0;
  double scale = 1;  ///< factor for the stored value
  std::size_t count = 1;
  bool is_text = false;
};

struct DataflashField {
  std::string name;
  FieldType type;
  std::size_t offset;  ///< from the end of the message's header
  bool is_instance = false;
};
struct DataflashFormat {
  std::string name, definition;
  std::size_t bytes = 0;               ///< of a message including its header
  std::vector<DataflashField> fields;  ///< empty if the definition is inconsistent

  const DataflashField* find(const std::string& field) const {
    for (const DataflashField& candidate : fields)
      if (candidate.name == field) return &candidate;
    return nullptr;
  }
};

std::optional<FieldType> field_type(char letter) {
  static const std::map<char, FieldType> special = {
      {'a', {Scalar::kInt16, 64, 1, 32}},   {'M', {Scalar::kUint8, 1}},
      {'c', {Scalar::kInt16, 2, 0.01}},     {'C', {Scalar::kUint16, 2, 0.01}},
      {'e', {Scalar::kInt32, 4, 0.01}},     {'E', {Scalar::kUint32, 4, 0.01}},
      {'L', {Scalar::kInt32, 4, 1e-7}},     {'g', {std::nullopt, 2}},
      {'n', {std::nullopt, 4, 1, 1, true}}, {'N', {std::nullopt, 16, 1, 1, true}},
      {'Z', {std::nullopt, 64, 1, 1, true}}};
  const auto found = special.find(letter);
  if (found != special.end()) return found->second;
  const std::optional<Scalar> plain = scalar_of_letter(letter);
  return plain ? std::optional(FieldType{plain, size_of(*plain)}) : std::nullopt;
}

/// Returns the IEEE 754 binary16 number at `bytes`.
double half_float(const char* bytes) {
  const auto bits = static_cast<std::uint16_t>(value_of(Scalar::kUint16, bytes));
  return Eigen::half_impl::half_to_float(Eigen::half_impl::raw_uint16_to_half(bits));
}

/// Parses field types ("QBff") and names ("TimeUS,I,AccX,AccY"). Returns nothing if they contradict each other or
/// `bytes`.
std::vector<DataflashField> parse_fields(const std::string& letters, const std::string& names,
                                         std::size_t bytes) {
  std::vector<DataflashField> fields;
  std::set<std::string> seen;
  std::size_t offset = 0, begin = 0;
  for (const char letter : letters) {
    const std::size_t end = std::min(names.find(',', begin), names.size());
    const std::string name = begin < names.size() ? names.substr(begin, end - begin) : "";
    const std::optional<FieldType> type = field_type(letter);
    if (!type || !is_identifier(name) || !seen.insert(name).second) return {};
    fields.push_back({name, *type, offset});
    offset += type->bytes;
    begin = end + 1;
  }
  const bool fits = begin > names.size() && offset + kDataflashHead_bytes == bytes;
  return fits ? fields : std::vector<DataflashField>();
}

constexpr std::string_view kDataflashStart = "\xA3\x95";
constexpr std::uint8_t kFormatId = 128;
constexpr std::size_t kFormatMessage_bytes = 89;

class DataflashReader {
 public:
  DataflashReader(std::string_view bytes, const std::string& path) : bytes_(bytes) {
    log_.path = path;
    log_.format = "ardupilot";
  }

  RawLog read() {
    if (!looks_like_dataflash(bytes_)) {
      refuse_at(log_.path, 0, "message", "", "is not a format definition, with which these logs start",
                "is this an ArduPilot log? Text logs (.log) can be converted to .bin");
    }
    // Definitions, units and multipliers may follow the messages that need them.
    walk([this](std::uint8_t id, std::string_view body) { take_definition(id, body); });
    apply_units();
    log_.health = {};
    left_out_.clear();
    walk([this](std::uint8_t id, std::string_view body) { take_message(id, body); });
    finish();
    return std::move(log_);
  }

 private:
  /// Returns the size in bytes of the message at `at`; 0 if there is none of a known format.
  std::size_t message_size(std::size_t at) const {
    if (bytes_.substr(at, 2) != kDataflashStart || bytes_.size() - at < kDataflashHead_bytes) return 0;
    const auto id = static_cast<std::uint8_t>(bytes_[at + 2]);
    const std::size_t size = id == kFormatId ? kFormatMessage_bytes : formats_[id].bytes;
    return size <= bytes_.size() - at ? size : 0;
  }
  bool starts_message(std::size_t at) const {
    return at == bytes_.size() || bytes_.substr(at, 2) == kDataflashStart;
  }

  template <typename Visit>
  void walk(const Visit& visit) {
    std::size_t at = 0;
    while (at < bytes_.size()) {
      const std::size_t size = message_size(at);
      // Accept a message if another one follows, or if the file ends within the next header.
      if (size > 0 && (starts_message(at + size) || bytes_.size() - at - size < kDataflashHead_bytes)) {
        visit(static_cast<std::uint8_t>(bytes_[at + 2]),
              bytes_.substr(at + kDataflashHead_bytes, size - kDataflashHead_bytes));
        at += size;
        continue;
      }
      at = leave_out(at, size);
    }
  }

  /// Skips to the next byte at which a message starts that is followed by another.
  /// @param size of a message at `at` that is not followed by another
  std::size_t leave_out(std::size_t at, std::size_t size) {
    const bool is_unknown = size == 0 && bytes_.substr(at, 2) == kDataflashStart &&
                            bytes_.size() - at >= kDataflashHead_bytes &&
                            static_cast<std::uint8_t>(bytes_[at + 2]) != kFormatId &&
                            formats_[static_cast<std::uint8_t>(bytes_[at + 2])].bytes == 0;
    std::size_t next = at + 1;
    while (next < bytes_.size() && !is_found(next, is_unknown)) ++next;
    if (next == bytes_.size()) {
      log_.health.truncated = true;
      log_.health.skipped_bytes += next - at;
    } else if (is_unknown) {
      ++left_out_[{fmt::format("message id {}", static_cast<std::uint8_t>(bytes_[at + 2])),
                   "the file lost the definition of its format"}];
    } else {
      ++log_.health.damaged_blocks;
      log_.health.skipped_bytes += next - at;
    }
    return next;
  }
  /// @param counts_unknown accept any header, because after a message of an unknown format several of them may follow
  bool is_found(std::size_t at, bool counts_unknown) const {
    if (bytes_.substr(at, 2) != kDataflashStart) return false;
    const std::size_t size = message_size(at);
    return size > 0 ? starts_message(at + size)
                    : counts_unknown && bytes_.size() - at >= kDataflashHead_bytes;
  }

  void take_definition(std::uint8_t id, std::string_view body) {
    if (id == kFormatId) return take_format(body);
    const DataflashFormat& format = formats_[id];
    if (format.name == "FMTU")
      take_unit_ids(format, body);
    else if (format.name == "MULT")
      multipliers_.emplace(letter_in(format, body, "Id"), number_in(format, body, "Mult"));
  }

  void take_format(std::string_view body) {
    const auto id = static_cast<std::uint8_t>(body[0]);
    DataflashFormat format;
    format.bytes = static_cast<unsigned char>(body[1]);
    format.name = until_nul(body.substr(2, 4));
    format.definition = std::string(body.substr(1));
    const bool is_known = formats_[id].bytes > 0;
    const bool is_sound = format.bytes > kDataflashHead_bytes && is_identifier(format.name);
    if (!is_sound || (is_known && formats_[id].definition != format.definition)) {
      ++damaged_formats_;
      return;
    }
    if (is_known) return;
    format.fields = parse_fields(until_nul(body.substr(6, 16)), until_nul(body.substr(22, 64)), format.bytes);
    formats_[id] = std::move(format);
  }

  double number_in(const DataflashFormat& format, std::string_view body, const std::string& name) const {
    const DataflashField* const field = format.find(name);
    if (field == nullptr || !field->type.number) return NAN;
    return value_of(*field->type.number, body.data() + field->offset);
  }
  char letter_in(const DataflashFormat& format, std::string_view body, const std::string& name) const {
    const double number = number_in(format, body, name);
    return number >= 0 && number < 128 ? static_cast<char>(number) : '\0';
  }
  std::string text_in(const DataflashFormat& format, std::string_view body, const std::string& name) const {
    const DataflashField* const field = format.find(name);
    return field == nullptr || !field->type.is_text
               ? ""
               : until_nul(body.substr(field->offset, field->type.bytes));
  }

  void take_unit_ids(const DataflashFormat& format, std::string_view body) {
    const double id = number_in(format, body, "FmtType");
    if (id >= 0 && id < 256)
      unit_ids_[static_cast<std::size_t>(id)] = {text_in(format, body, "UnitIds"),
                                                 text_in(format, body, "MultIds")};
  }

  /// Assigns units and multipliers to the fields.
  void apply_units() {
    for (std::size_t id = 0; id < formats_.size(); ++id) {
      const auto& [units, multipliers] = unit_ids_[id];
      for (std::size_t i = 0; i < formats_[id].fields.size(); ++i) {
        DataflashField& field = formats_[id].fields[i];
        const char unit = i < units.size() ? units[i] : '-';
        const char multiplier = i < multipliers.size() ? multipliers[i] : '-';
        // Files without FMTU mark instances only by the names that ArduPilot gives these fields in LogStructure.h.
        const bool is_called_instance = field.name == "I" || field.name == "C" || field.name == "Inst";
        field.is_instance = (unit == '#' || (units.empty() && is_called_instance)) && field.type.number;
        const auto found = multipliers_.find(multiplier);
        const bool has_own_scale = field.type.scale != 1;
        if (found != multipliers_.end() && !has_own_scale && found->second > 0 &&
            std::isfinite(found->second))
          field.type.scale = found->second;
      }
    }
  }

  static std::optional<double> time_of(const DataflashFormat& format, std::string_view body) {
    for (const auto& [name, per_second] : {std::pair{"TimeUS", 1e6}, std::pair{"TimeMS", 1e3}}) {
      const DataflashField* const field = format.find(name);
      if (field != nullptr && field->type.number)
        return value_of(*field->type.number, body.data() + field->offset) / per_second;
    }
    return std::nullopt;
  }

  void take_message(std::uint8_t id, std::string_view body) {
    const DataflashFormat& format = formats_[id];
    if (id == kFormatId || format.name == "FMTU" || format.name == "UNIT" || format.name == "MULT") return;
    const std::optional<double> time_s = time_of(format, body);
    if (format.name == "PARM") return take_parameter(format, body);
    if (format.name == "MSG") return log_.messages.push_back(text_in(format, body, "Message"));
    if (format.fields.empty() || !time_s) {
      ++left_out_[{format.name, format.fields.empty() ? "the definition of its format contradicts itself"
                                                      : "it has no field \"TimeUS\" or \"TimeMS\""}];
      return;
    }
    RawTopic& topic = topic_of(id, body);
    topic.time_s.push_back(*time_s);
    std::size_t column = 0;
    for (const DataflashField& field : format.fields) {
      const char* const data = body.data() + field.offset;
      if (field.type.is_text || is_time(field)) continue;
      for (std::size_t i = 0; i < field.type.count; ++i)
        topic.columns[column++].values.push_back(number_of(field, data, i));
    }
    ++log_.health.records;
  }

  static bool is_time(const DataflashField& field) {
    return field.name == "TimeUS" || field.name == "TimeMS";
  }

  static double number_of(const DataflashField& field, const char* data, std::size_t index) {
    if (!field.type.number) return half_float(data) * field.type.scale;
    return value_of(*field.type.number, data + index * size_of(*field.type.number)) * field.type.scale;
  }

  RawTopic& topic_of(std::uint8_t id, std::string_view body) {
    const DataflashFormat& format = formats_[id];
    int instance = 0;
    for (const DataflashField& field : format.fields) {
      if (!field.is_instance) continue;
      const double number = value_of(*field.type.number, body.data() + field.offset);
      if (number >= 0 && number < 256) instance = static_cast<int>(number);
    }
    // Two ids with the same name form one topic only if they have the same fields.
    const auto [found, is_new] = topics_.emplace(std::pair{id, instance}, log_.topics.size());
    if (!is_new) return log_.topics[found->second];
    RawTopic topic;
    topic.name = names_.emplace(format.name, id).first->second == id ? format.name
                                                                     : fmt::format("{}#{}", format.name, id);
    topic.type = format.name;
    topic.instance = instance;
    for (const DataflashField& field : format.fields) {
      if (field.type.is_text || is_time(field)) continue;
      for (std::size_t i = 0; i < field.type.count; ++i) {
        const std::string suffix = field.type.count > 1 ? "[" + std::to_string(i) + "]" : "";
        topic.columns.push_back({field.name + suffix, {}});
      }
    }
    log_.topics.push_back(std::move(topic));
    return log_.topics.back();
  }

  void take_parameter(const DataflashFormat& format, std::string_view body) {
    const std::string name = text_in(format, body, "Name");
    const double value = number_in(format, body, "Value");
    if (!name.empty()) log_.parameters.emplace(name, value);
  }

  void finish() {
    log_.health.damaged_blocks += damaged_formats_;
    for (const auto& [what, count] : left_out_) log_.left_out.push_back({what.first, what.second, count});
  }

  const std::string_view bytes_;
  RawLog log_;
  std::array<DataflashFormat, 256> formats_;
  /// Letters of the units and multipliers of a format's fields.
  std::array<std::pair<std::string, std::string>, 256> unit_ids_;
  std::map<char, double> multipliers_;
  std::map<std::pair<std::uint8_t, int>, std::size_t> topics_;  ///< index in log_.topics
  std::map<std::string, std::uint8_t> names_;
  std::map<std::pair<std::string, std::string>, std::size_t> left_out_;  ///< messages by name and reason
  std::size_t damaged_formats_ = 0;
};

}  // namespace

bool looks_like_dataflash(std::string_view head) {
  return head.substr(0, 2) == kDataflashStart && head.size() > 2 &&
         static_cast<std::uint8_t>(head[2]) == kFormatId;
}

RawLog read_dataflash(std::string& bytes, const std::string& path) {
  return DataflashReader(bytes, path).read();
}

}  // namespace swarmcert::logs
