/// @file Periodic components of the remainder, whatever their phase.
#pragma once

#include "analysis/identification/scan/curve_fit.h"
#include "analysis/identification/scan/scan.h"

namespace swarmcert::identification {

/// Adds an entry for each world component of the force remainder that contains a sine of one frequency, with a separate
/// phase for each piece of at most 100 s. It replaces the entry for a slower dependence on time if it explains more.
/// Frequencies go up to 2 Hz, in steps of half a cycle per piece. A sine is reported if its power exceeds the largest
/// power under random signs of the chunks by three standard deviations; its share is evaluated on held-out chunks.
void add_periods(const ScanSamples& samples, const Chunks& chunks, Scan& scan);

}  // namespace swarmcert::identification
