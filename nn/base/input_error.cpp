#include "nn/base/input_error.h"

#include <utility>

namespace swarmcert::files {
namespace {

std::string one_line(const InputFault& fault) {
  std::string text = fault.file;
  const auto part = [&text](const std::string& piece) {
    if (piece.empty()) return;
    if (!text.empty()) text += ": ";
    text += piece;
  };
  part(fault.where);
  part(fault.field.empty() || fault.value.empty() ? fault.field + fault.value
                                                  : fault.field + " = " + fault.value);
  part(fault.what);
  if (!fault.hint.empty()) text += "; " + fault.hint;
  for (char& c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7f) c = '?';
  }
  return text;
}

}  // namespace

InputError::InputError(InputFault fault) : std::runtime_error(one_line(fault)), fault_(std::move(fault)) {}

std::string in_quotes(std::string_view text) {
  constexpr std::size_t kLongest = 80;
  std::string result = "\"";
  result += text.substr(0, kLongest);
  result += text.size() > kLongest ? "...\"" : "\"";
  return result;
}

}  // namespace swarmcert::files
