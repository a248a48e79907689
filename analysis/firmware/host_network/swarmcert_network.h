/// @file In place of an exported network: the names that the Crazyflie app uses, for any network (app_on_host.cpp).
#pragma once

#include "nn/deep_set.h"

namespace swarmcert_network {

inline constexpr int kMostNeighbours = 64, kInputs = 6;
inline constexpr bool kTakesRelativeState = true;
extern int kOwnKinds;

swarmcert::nn::DeepSetStatus predict_force_z(int own_kind, const float* own,
                                             const swarmcert::nn::Neighbour<float>* neighbours,
                                             int num_neighbours, float* force_N);

enum class SelfTest : std::uint8_t { kPassed, kFusedArithmetic, kOtherBits, kOtherWeights };
SelfTest self_test(int* failed);

}  // namespace swarmcert_network
