/// @file The subset of the protocol buffer wire format that ONNX files use.
///
/// libprotobuf would parse the file as well, but it would bring a code generator and a library whose version must fit
/// the compiler's to every user, for a dozen fields; and it allocates what a file declares before anybody can look.
/// This reader allocates nothing: fields are views into the bytes.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace swarmcert::files {

/// One field of a message.
struct ProtobufField {
  std::uint32_t number = 0;
  std::uint64_t value = 0;  ///< of a varint or a fixed 32 or 64 bit field; fixed ones as their bits
  std::string_view
      bytes;  ///< of a length-delimited field: text, message or packed numbers; of a fixed one its bytes
  bool is_bytes = false;   ///< length-delimited
  std::size_t offset = 0;  ///< of the field's tag in the file
};

/// Walks over the fields of one message.
class ProtobufReader {
 public:
  /// @param message part of a file that begins at `offset` of it; must outlive this.
  ProtobufReader(std::string_view message, std::size_t offset, std::string path)
      : message_(message), offset_(offset), path_(std::move(path)) {}

  /// The next field; false at the end.
  /// @throws InputError with the offset if a tag, number or length is damaged, or a group begins (nothing writes them).
  bool next(ProtobufField& field);

 private:
  std::uint64_t varint();
  [[noreturn]] void refuse(const std::string& what) const;

  std::string_view message_;
  std::size_t offset_;
  std::string path_;
  std::size_t at_ = 0;
};

/// The integers of a repeated field, whether it came as one number or packed.
/// @throws InputError as ProtobufReader::next().
void append_integers(const ProtobufField& field, const std::string& path,
                     std::vector<std::int64_t>& integers);

}  // namespace swarmcert::files
