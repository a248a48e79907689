/// Calls parse_raw() with arbitrary bytes: InputError, or a log that satisfies the invariants of RawLog.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <sstream>

#include "analysis/logs/formats/formats.h"
#include "logs/raw_log_invariant.h"
#include "nn/base/input_error.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace swarmcert;
  std::istringstream in(std::string(reinterpret_cast<const char*>(data), size));
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
