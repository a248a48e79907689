/// Calls parse_raw() with arbitrary bytes: InputError, or a log that satisfies the invariants of RawLog. Micro-SD logs,
/// which get their times later, are for log_fuzzer.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <sstream>

#include "analysis/logs/formats/formats.h"
#include "logs/raw_log_invariant.h"
#include "nn/base/input_error.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace swarmcert;
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  if (logs::looks_like_usd(bytes)) return 0;
  std::istringstream in(bytes);
  try {
    const std::string broken = tests::broken_rule(logs::parse_raw(in, "fuzz"));
    if (!broken.empty()) {
      std::fprintf(stderr, "%s\n", broken.c_str());
      std::abort();
    }
  } catch (const files::InputError&) {
  }
  return 0;
}
