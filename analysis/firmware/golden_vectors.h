/// @file Inputs of a network with the outputs that flight code must give for them, bit for bit.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "nn/deep_set.h"
#include "nn/weights/network.h"

namespace swarmcert::firmware {

struct GoldenVector {
  int own_kind = 0;                        ///< index into Network::rho
  std::vector<float> own;                  ///< [files::kGroundInputs]
  std::vector<std::vector<float>> inputs;  ///< of each neighbour
  std::vector<int> kinds;                  ///< of each neighbour: index into files::neighbour_kinds()
  nn::DeepSetStatus status = nn::DeepSetStatus::kOk;
  float force_N = 0;
};

/// Newton per unit of the network's output; gram-force unless it states a unit, as published.
/// @throws files::InputError if the network states a quantity that is not a vertical force.
float newton_per_unit(const files::Network& network);

/// `count` random vectors for each kind of vehicle, with no neighbours to `most_neighbours`; inputs reach half as far
/// again as the clamp of states, or +-1 m and +-2 m/s. One more for each composition of at most `most_neighbours`
/// neighbours in which the network is silent. Expected outputs are computed by the evaluator of the flight code.
/// Precondition: every weight is a float32; the network is a deep set.
std::vector<GoldenVector> golden_vectors(const files::Network& network, int count, int most_neighbours,
                                         std::uint64_t seed);

}  // namespace swarmcert::firmware
