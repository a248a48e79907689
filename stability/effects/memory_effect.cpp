#include "stability/effects/memory_effect.h"

#include <stdexcept>

namespace swarmcert::stability {

void MemoryEffect::columns(const Instant&, const double*, Wrench*) const {
  throw std::logic_error("Effect::columns: " + info().name + " has a memory: use stream()");
}

}  // namespace swarmcert::stability
