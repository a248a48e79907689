/// Calls parse_json() with arbitrary text: InputError, or a document that survives a write and read. Calls
/// parse_hex_float() with arbitrary text: std::invalid_argument, or a number that survives both.
#include <cstdint>
#include <cstdlib>
#include <stdexcept>

#include "nn/base/input_error.h"
#include "nn/base/json.h"

namespace {

using namespace swarmcert::files;

void check_document(const std::string& text) {
  try {
    const Json document = parse_json(text, "fuzz");
    if (parse_json(to_text(document), "fuzz again") != document) std::abort();
  } catch (const InputError&) {
  }
}

void check_number(const std::string& text) {
  try {
    const double number = parse_hex_float(text);
    if (parse_hex_float(hex_float(number)) != number) std::abort();
  } catch (const std::invalid_argument&) {
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  check_document(text);
  check_number(text);
  return 0;
}
