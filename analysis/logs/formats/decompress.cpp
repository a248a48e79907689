#include "analysis/logs/formats/decompress.h"

#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <memory>

namespace swarmcert::logs {
namespace {

constexpr std::size_t kBuffer_bytes = std::size_t{1} << 16;

Decompressed decompress_zstd(std::string_view compressed, std::size_t limit) {
  Decompressed result;
  const std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context(ZSTD_createDCtx(), &ZSTD_freeDCtx);
  if (!context) return result;
  // A frame's header requests the memory of its window; level 19 needs 2^23.
  constexpr int kLargestWindow_log2 = 24;
  ZSTD_DCtx_setParameter(context.get(), ZSTD_d_windowLogMax, kLargestWindow_log2);
  const std::unique_ptr<char[]> buffer(new char[kBuffer_bytes]);
  ZSTD_inBuffer in{compressed.data(), compressed.size(), 0};
  std::size_t state = 1;
  while (true) {
    ZSTD_outBuffer out{buffer.get(), kBuffer_bytes, 0};
    state = ZSTD_decompressStream(context.get(), &out, &in);
    if (ZSTD_isError(state) != 0) return result;
    result.is_too_large = result.bytes.size() + out.pos > limit;
    if (result.is_too_large) return result;
    result.bytes.append(buffer.get(), out.pos);
    if (in.pos == in.size && out.pos < out.size) break;
  }
  result.is_whole = state == 0;
  return result;
}

Decompressed decompress_lz4(std::string_view compressed, std::size_t limit) {
  Decompressed result;
  LZ4F_dctx* raw = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&raw, LZ4F_VERSION)) != 0) return result;
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context(
      raw, &LZ4F_freeDecompressionContext);
  const std::unique_ptr<char[]> buffer(new char[kBuffer_bytes]);
  std::size_t at = 0, expected = 1;
  while (true) {
    std::size_t in_bytes = compressed.size() - at;
    std::size_t out_bytes = kBuffer_bytes;
    expected =
        LZ4F_decompress(context.get(), buffer.get(), &out_bytes, compressed.data() + at, &in_bytes, nullptr);
    if (LZ4F_isError(expected) != 0) return result;
    at += in_bytes;
    result.is_too_large = result.bytes.size() + out_bytes > limit;
    if (result.is_too_large) return result;
    result.bytes.append(buffer.get(), out_bytes);
    if (at == compressed.size() && out_bytes < kBuffer_bytes) break;
    if (in_bytes == 0 && out_bytes == 0) return result;  // no progress: nothing more will come
  }
  result.is_whole = expected == 0;
  return result;
}

}  // namespace

Decompressed decompress(Compression compression, std::string_view compressed, std::size_t limit_bytes) {
  if (compression == Compression::kZstd) return decompress_zstd(compressed, limit_bytes);
  if (compression == Compression::kLz4) return decompress_lz4(compressed, limit_bytes);
  return {std::string(compressed), true, false};
}

bool looks_like_zstd(std::string_view bytes) { return bytes.substr(0, 4) == "\x28\xB5\x2F\xFD"; }

std::size_t decompression_limit(std::size_t file_bytes) {
  constexpr std::size_t kAlways_bytes = std::size_t{1} << 24;
  constexpr std::size_t kLargestRatio = 100;
  constexpr std::size_t kLargest_bytes = std::size_t{4} << 30;
  return std::min(kAlways_bytes + kLargestRatio * file_bytes, kLargest_bytes);
}

}  // namespace swarmcert::logs
