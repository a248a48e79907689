/// @file The subset of the protocol buffer wire format that ONNX files use.
///
/// libprotobuf could parse the file as well, but it would require a code generator and a library whose version must
/// match the compiler's from every user, for a dozen fields; and it allocates whatever a file declares before any size
/// can be checked. This reader does not allocate: fields are views into the bytes.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace swarmcert::files {

/// One field of a message.
struct ProtobufField {
  std::uint32_t number = 0;
  std::uint64_t value = 0;  ///< value of a varint, or bits of a fixed 32-bit or 64-bit field
  std::string_view bytes;   ///< length-delimited: text, message or packed numbers; fixed: its bytes
  bool is_bytes = false;    ///< length-delimited
  std::size_t offset = 0;   ///< offset of the field's tag in the file
};

/// Iterates over the fields of one message.
class ProtobufReader {
 public:
  /// @param message part of a file, at `offset` in that file; must outlive this object.
  ProtobufReader(std::string_view message, std::size_t offset, std::string path)
      : message_(message), offset_(offset), path_(std::move(path)) {}

  /// Reads the next field; returns false at the end.
  /// @throws InputError with the offset if a tag, number or length is damaged, or a group begins (no writer uses
  ///   groups).
  bool next(ProtobufField& field);

 private:
  std::uint64_t varint();
  [[noreturn]] void refuse(const std::string& what) const;

  std::string_view message_;
  std::size_t offset_;
  std::string path_;
  std::size_t at_ = 0;
};

/// Appends the integers of a repeated field, whether it is stored as a single number or packed.
/// @throws InputError as ProtobufReader::next().
void append_integers(const ProtobufField& field, const std::string& path,
                     std::vector<std::int64_t>& integers);

}  // namespace swarmcert::files
