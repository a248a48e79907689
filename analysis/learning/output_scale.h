/// @file How much of each network's output the selecting flights support.
#pragma once

#include <map>
#include <string>

#include "analysis/learning/dataset.h"

namespace swarmcert::learning {

/// Scale s in [0, 1] of every kind's output: over the selecting samples of that kind it minimises
/// sum_c mean |y - s f|^2 over the compositions c (small+small>small, ...), subject to
/// mean |y - s f|^2 <= mean |y|^2 in each of them, so that no composition is worse with the network than without it.
/// Per composition that is s <= 2 <y, f> / <f, f>. A kind without selecting samples keeps 1; 0 leaves no network.
/// Holds on the selecting samples; elsewhere it is an estimate.
std::map<std::string, double> output_scales(const LearningData& data, const training::Vector& theta);

/// Multiplies weights and biases of the last layer of the rho of each kind by its scale. A scale of at most 1 keeps
/// every limit on norms and Lipschitz constants.
void scale_outputs(const training::Layout& layout, const std::map<std::string, double>& scales,
                   training::Vector& theta);

}  // namespace swarmcert::learning
