/// @file How much of each network's output the selecting flights support.
#pragma once

#include <map>
#include <string>

#include "analysis/learning/dataset.h"

namespace swarmcert::learning {

/// Scale s in [0, 1] of every kind's output f: over the samples of `use` of that kind it minimises
/// sum_c mean |y - s f|^2 over the compositions c (small+small>small, ...), subject to
/// mean |y - s f|^2 <= mean |y|^2 in each of them, so that no composition is worse with the network than without it.
/// Per composition that is s <= 2 <y, f> / <f, f>. A kind without such samples keeps 1; 0 leaves no network.
/// Holds on these samples; elsewhere it is an estimate, and only of flights that f was not fitted to.
/// @param outputs [outputs x samples] f, of the samples of `use` at least.
std::map<std::string, double> output_scales(const LearningData& data, const training::Matrix& outputs,
                                            Use use = Use::kSelect);

/// Multiplies f of every sample by the scale of its vehicle's kind.
void scale_outputs(const LearningData& data, const std::map<std::string, double>& scales,
                   training::Matrix& outputs);

/// Multiplies weights and biases of the last layer of the rho of each kind by its scale. A scale of at most 1 keeps
/// every limit on norms and Lipschitz constants.
void scale_outputs(const training::Layout& layout, const std::map<std::string, double>& scales,
                   training::Vector& theta);

}  // namespace swarmcert::learning
