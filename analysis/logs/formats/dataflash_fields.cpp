#include "analysis/logs/formats/dataflash_fields.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace swarmcert::logs {
namespace {

std::optional<FieldType> field_type(char letter) {
  const auto number = [](Scalar type, double scale = 1, std::size_t count = 1) {
    return FieldType{type, count * size_of(type), count, scale, false};
  };
  const auto text = [](std::size_t bytes) { return FieldType{std::nullopt, bytes, 1, 1, true}; };
  switch (letter) {
    case 'a':
      return number(Scalar::kInt16, 1, 32);
    case 'b':
      return number(Scalar::kInt8);
    case 'B':
    case 'M':
      return number(Scalar::kUint8);
    case 'h':
      return number(Scalar::kInt16);
    case 'H':
      return number(Scalar::kUint16);
    case 'i':
      return number(Scalar::kInt32);
    case 'I':
      return number(Scalar::kUint32);
    case 'q':
      return number(Scalar::kInt64);
    case 'Q':
      return number(Scalar::kUint64);
    case 'f':
      return number(Scalar::kFloat);
    case 'd':
      return number(Scalar::kDouble);
    case 'g':
      return FieldType{std::nullopt, 2, 1, 1, false};
    case 'c':
      return number(Scalar::kInt16, 0.01);
    case 'C':
      return number(Scalar::kUint16, 0.01);
    case 'e':
      return number(Scalar::kInt32, 0.01);
    case 'E':
      return number(Scalar::kUint32, 0.01);
    case 'L':
      return number(Scalar::kInt32, 1e-7);
    case 'n':
      return text(4);
    case 'N':
      return text(16);
    case 'Z':
      return text(64);
    default:
      return std::nullopt;
  }
}

}  // namespace

double half_float(const char* bytes) {
  const auto bits = static_cast<unsigned>(value_of(Scalar::kUint16, bytes));
  const int exponent = static_cast<int>(bits >> 10 & 31);
  const double fraction = bits & 1023;
  const double sign = (bits & 0x8000) != 0 ? -1 : 1;
  if (exponent == 31) return fraction == 0 ? sign * INFINITY : NAN;
  return sign * (exponent == 0 ? std::ldexp(fraction, -24) : std::ldexp(1024 + fraction, exponent - 25));
}

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
    fields.push_back({name, letter, *type, offset, "", false});
    offset += type->bytes;
    begin = end + 1;
  }
  const bool fits = begin > names.size() && offset + kDataflashHead_bytes == bytes;
  return fits ? fields : std::vector<DataflashField>();
}

}  // namespace swarmcert::logs
