/// @file Formulas for attractive or repulsive forces between vehicles.
#pragma once

#include <string>

#include "analysis/identification/scan/scan.h"
#include "stability/model.h"

namespace swarmcert::identification {

/// A horizontal force towards each neighbour that decreases with distance, as an effect with per_neighbour: either f(r)
/// along the horizontal direction, where r is the horizontal distance, or the horizontal part of f(d) along the line
/// between the vehicles, where d is their distance.
struct Pull {
  std::string form;              ///< "decay"
  stability::EffectSpec effect;  ///< with its numbers, without a name
  double saved_bits = 0;         ///< compared with no force
  double explained_N2 = 0;       ///< reduction of the mean square
};

/// Returns whether the entry describes such a force.
bool is_pull(const ScanSamples& samples, const ScanEntry& entry);

/// Returns the best form that vanishes at large distances, fitted to the nearest neighbour.
Pull find_pull(const ScanSamples& samples);

}  // namespace swarmcert::identification
