/// Calls parse_log() with arbitrary bytes: InputError, or samples that satisfy the invariants of Log.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <sstream>

#include "analysis/logs/read_log.h"
#include "nn/base/input_error.h"

namespace {

using namespace swarmcert;

void demand(bool holds) {
  if (!holds) std::abort();
}

void check_invariant(const logs::Log& log) {
  demand(log.health.records == log.samples.size());
  double last_us = -INFINITY;
  for (const logs::Sample& sample : log.samples) {
    demand(std::isfinite(sample.time_us) && sample.time_us > last_us);
    last_us = sample.time_us;
    for (const double x : sample.position_m) demand(std::isfinite(x));
    for (const double x : sample.attitude.xyzw()) demand(std::isfinite(x));
    if (!log.signals.force) continue;
    for (const double x : sample.specific_force_m_s2) demand(std::isfinite(x));
    for (const double x : sample.duty) demand(std::isfinite(x));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::istringstream in(std::string(reinterpret_cast<const char*>(data), size));
  try {
    check_invariant(logs::parse_log(in, "fuzz"));
  } catch (const files::InputError&) {
  }
  return 0;
}
