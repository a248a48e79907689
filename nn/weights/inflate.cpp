#include "nn/weights/inflate.h"

#include <zlib.h>

#include <limits>
#include <vector>

namespace swarmcert::files {

std::optional<std::string> inflated(std::string_view data, std::uint64_t limit_bytes) {
  if (data.size() > std::numeric_limits<uInt>::max()) return std::nullopt;
  z_stream stream{};
  if (inflateInit(&stream) != Z_OK) return std::nullopt;
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(data.data()));
  stream.avail_in = static_cast<uInt>(data.size());
  std::vector<char> buffer(std::size_t{1} << 16);
  std::string result;
  int status = Z_OK;
  while (status == Z_OK && result.size() <= limit_bytes) {
    stream.next_out = reinterpret_cast<Bytef*>(buffer.data());
    stream.avail_out = static_cast<uInt>(buffer.size());
    status = inflate(&stream, Z_NO_FLUSH);
    result.append(buffer.data(), buffer.size() - stream.avail_out);
  }
  inflateEnd(&stream);
  if (status != Z_STREAM_END && result.size() <= limit_bytes) return std::nullopt;
  return result;
}

}  // namespace swarmcert::files
