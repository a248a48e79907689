/// @file What repeats in time, whatever its phase.
#pragma once

#include "analysis/identification/scan/curve_fit.h"
#include "analysis/identification/scan/scan.h"

namespace swarmcert::identification {

/// Of forces. Adds an entry for each component of the remainder in the world that holds a sine of one frequency, with a
/// phase for each piece of at most 100 s; beside a slower dependence on time, it takes that entry's place where it
/// explains more. Frequencies up to 2 Hz, half a cycle per piece apart. A sine counts if its power exceeds the largest
/// of what draws of the chunks' signs leave by three standard deviations; its share is that of chunks left out.
void add_periods(const ScanSamples& samples, const Chunks& chunks, Scan& scan);

}  // namespace swarmcert::identification
