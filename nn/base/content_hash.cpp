#include "nn/base/content_hash.h"

#include <cstdint>
#include <cstdio>
#include <cstring>
#include <map>
#include <stdexcept>

#include "nn/base/file_io.h"

namespace swarmcert::files {
namespace {

void encode_string(const std::string& text, std::string& out) {
  out += 's' + std::to_string(text.size()) + ':' + text;
}

void encode(const Json& value, std::string& out) {
  if (value.is_null()) {
    out += 'n';
  } else if (value.is_boolean()) {
    out += value.get<bool>() ? 't' : 'f';
  } else if (value.is_number()) {
    const double number = value.get<double>();
    std::uint64_t bits = 0;
    std::memcpy(&bits, &number, sizeof bits);
    char digits[20];
    std::snprintf(digits, sizeof digits, "d%016llx", static_cast<unsigned long long>(bits));
    out += digits;
  } else if (value.is_string()) {
    encode_string(value.get_ref<const std::string&>(), out);
  } else if (value.is_array()) {
    out += '[';
    for (const Json& element : value) encode(element, out);
    out += ']';
  } else {
    std::map<std::string, const Json*> members;
    for (const auto& [name, member] : value.items()) members[name] = &member;
    out += '{';
    for (const auto& [name, member] : members) {
      encode_string(name, out);
      encode(*member, out);
    }
    out += '}';
  }
}

}  // namespace

std::string content_sha256(const Json& document) {
  if (!document.is_object()) throw std::invalid_argument("content_sha256: the document is not a JSON object");
  Json rest = document;
  rest.erase("content_sha256");
  std::string bytes;
  encode(rest, bytes);
  return sha256(bytes);
}

}  // namespace swarmcert::files
