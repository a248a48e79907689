/// @file Samples that the project's own tools write beside a network, for certify --samples.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "nn/weights/samples.h"

namespace swarmcert::files {

/// Returns the output of a part as computed by the program that is recorded.
using PartOutput =
    std::function<std::vector<double>(const std::string& part, const std::vector<float>& input)>;

/// Returns `count` samples of every part of NET at random float32 inputs: within the clamp if one applies to the part,
/// otherwise within +-2.
std::map<std::string, Samples> record_samples(const Network& network, const PartOutput& output, int count,
                                              std::uint64_t seed);

/// Returns a function that evaluates a part in float32, as flight code does.
/// Precondition: every weight is exactly representable in float32.
PartOutput float32_output(const Network& network);

}  // namespace swarmcert::files
