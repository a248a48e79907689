/// @file Samples that the project's own tools leave beside a network, for certify --samples.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "nn/weights/samples.h"

namespace swarmcert::files {

/// Output of a part, as the program that is recorded computes it.
using PartOutput =
    std::function<std::vector<double>(const std::string& part, const std::vector<float>& input)>;

/// `count` samples of every part of NET, at random float32 inputs: within the clamp where one acts on the part, else
/// within +-2.
std::map<std::string, Samples> record_samples(const Network& network, const PartOutput& output, int count,
                                              std::uint64_t seed);

/// The output of a part in float32, as flight code computes it.
/// Precondition: every weight is a float32.
PartOutput float32_output(const Network& network);

}  // namespace swarmcert::files
