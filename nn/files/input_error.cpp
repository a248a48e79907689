#include "nn/files/input_error.h"

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
  part(fault.value.empty() ? fault.field : fault.field + " = " + fault.value);
  part(fault.what);
  if (!fault.mend.empty()) text += "; " + fault.mend;
  return text;
}

}  // namespace

InputError::InputError(InputFault fault) : std::runtime_error(one_line(fault)), fault_(std::move(fault)) {}

}  // namespace swarmcert::files
