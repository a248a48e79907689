/// @file Formulas for forces that draw vehicles towards each other, or apart.
#pragma once

#include <string>

#include "analysis/identification/scan/scan.h"
#include "stability/model.h"

namespace swarmcert::identification {

/// A horizontal force towards every neighbour that falls with its distance, as an effect with per_neighbour: either
/// f(r) along the horizontal direction, r the horizontal distance, or the horizontal part of f(d) along the line
/// between the vehicles, d their distance.
struct Pull {
  std::string form;              ///< "decay"
  stability::EffectSpec effect;  ///< with its numbers, without a name
  double saved_bits = 0;         ///< against no force
  double explained_N2 = 0;       ///< what it takes off the mean square
};

/// Whether the entry is about such a force.
bool is_pull(const ScanSamples& samples, const ScanEntry& entry);

/// The best of the forms that vanish far away, fitted to the nearest neighbour.
Pull find_pull(const ScanSamples& samples);

}  // namespace swarmcert::identification
