/// Calls parse_samples() and parse_npy() with arbitrary bytes: InputError, or the stated number of finite numbers.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "nn/base/input_error.h"
#include "nn/weights/npy.h"
#include "nn/weights/samples.h"

namespace {

using namespace swarmcert::files;

void demand(bool holds) {
  if (!holds) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  try {
    const Samples samples = parse_samples(bytes, "fuzz", 2, 1);
    demand(samples.count() > 0 && samples.x.size() == 2 * samples.count() &&
           samples.y.size() == samples.count());
    for (const double number : samples.x) demand(std::isfinite(number));
    for (const double number : samples.y) demand(std::isfinite(number));
  } catch (const InputError&) {
  }
  try {
    const NpyArray array = parse_npy(bytes, "fuzz", "x.npy");
    std::uint64_t count = 1;
    for (const std::uint64_t extent : array.shape) count *= extent;
    demand(array.numbers.size() == count);
  } catch (const InputError&) {
  }
  return 0;
}
