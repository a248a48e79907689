/// @file Search for the witness that proves the gains of a loop to the checker of stability/checker.
#pragma once

#include <optional>
#include <string>

#include "stability/bounds/enclosures/verified_norms.h"
#include "stability/bounds/loops/axis_loop.h"
#include "stability/bounds/loops/sampled_loop.h"
#include "stability/checker/gain_bounds.h"
#include "stability/checker/sampled_gain_bounds.h"

namespace swarmcert::analysis {

struct ProvedGains {
  check::LoopWitness witness;
  check::GainBounds bounds;  ///< as computed by the checker
};

/// Searches for a quadratic form in which the loop contracts, and for the number of cells that brings the bounds to
/// within 1 % of `known`.
/// @param input force, command, velocity or position.
/// @returns nothing if no form was found or the bounds remain 5 % above `known`; `why` then holds the reason.
std::optional<ProvedGains> gain_witness(const stability::AxisLoop& loop, const std::string& input,
                                        const stability::VerifiedNorms& known, std::string& why);

struct ProvedSampledGains {
  check::SampledWitness witness;
  check::SampledGainBounds bounds;  ///< as computed by the checker
};

/// Enclosures for the four inputs of a sampled loop, valid at all times.
struct SampledEnclosures {
  stability::VerifiedNorms force, command, velocity, position;
};

/// The same for a sampled loop, for all inputs at once.
std::optional<ProvedSampledGains> sampled_gain_witness(const stability::SampledLoop& loop,
                                                       const SampledEnclosures& known, std::string& why);

}  // namespace swarmcert::analysis
