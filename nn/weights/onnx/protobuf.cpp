#include "nn/weights/onnx/protobuf.h"

#include "nn/base/input_error.h"

namespace swarmcert::files {
namespace {

/// Field numbers are below 2^29.
constexpr std::uint64_t kLargestNumber = (std::uint64_t{1} << 29) - 1;

/// Reads a varint at `at`; returns false if it is truncated or longer than 64 bits.
bool read_varint(std::string_view bytes, std::size_t& at, std::uint64_t& value) {
  value = 0;
  for (int shift = 0; shift < 64; shift += 7) {
    if (at == bytes.size()) return false;
    const auto byte = static_cast<unsigned char>(bytes[at++]);
    if (shift == 63 && byte > 1) return false;
    value |= static_cast<std::uint64_t>(byte & 0x7f) << shift;
    if (byte < 0x80) return true;
  }
  return false;
}

}  // namespace

void ProtobufReader::refuse(const std::string& what) const {
  throw InputError({path_, "offset " + std::to_string(offset_ + at_), "", "", what,
                    "the file is truncated, damaged or not an ONNX model: copy or export it again"});
}

std::uint64_t ProtobufReader::varint() {
  std::uint64_t value = 0;
  if (!read_varint(message_, at_, value)) refuse("a protobuf number is cut off or too long");
  return value;
}

bool ProtobufReader::next(ProtobufField& field) {
  if (at_ == message_.size()) return false;
  field = {};
  field.offset = offset_ + at_;
  const std::uint64_t tag = varint();
  if (tag >> 3 == 0 || tag >> 3 > kLargestNumber) refuse("is not a protobuf field number");
  field.number = static_cast<std::uint32_t>(tag >> 3);
  const auto wire = static_cast<int>(tag & 7);
  if (wire == 0) {
    field.value = varint();
    return true;
  }
  if (wire != 1 && wire != 2 && wire != 5) refuse("is not a protobuf field type that ONNX uses");
  const std::uint64_t length = wire == 2 ? varint() : wire == 1 ? 8 : 4;
  if (length > message_.size() - at_) refuse("a protobuf field is longer than what holds it");
  field.is_bytes = wire == 2;
  field.bytes = message_.substr(at_, length);
  at_ += length;
  if (wire == 2) return true;
  for (std::size_t i = length; i-- > 0;)
    field.value = field.value << 8 | static_cast<unsigned char>(field.bytes[i]);
  return true;
}

void append_integers(const ProtobufField& field, const std::string& path,
                     std::vector<std::int64_t>& integers) {
  if (!field.is_bytes) {
    integers.push_back(static_cast<std::int64_t>(field.value));
    return;
  }
  std::size_t at = 0;
  while (at < field.bytes.size()) {
    std::uint64_t value = 0;
    if (!read_varint(field.bytes, at, value)) {
      throw InputError({path, "offset " + std::to_string(field.offset), "", "",
                        "packed numbers are truncated", "the file is truncated or damaged: copy it again"});
    }
    integers.push_back(static_cast<std::int64_t>(value));
  }
}

}  // namespace swarmcert::files
