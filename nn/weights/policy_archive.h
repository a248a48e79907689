/// @file Policies that Stable-Baselines3 saved: a zip archive that holds a state dict and what the algorithm was.
#pragma once

#include <string>

#include "nn/weights/weights.h"
#include "nn/weights/zip_archive.h"

namespace swarmcert::files {

/// Returns whether the archive holds "policy.pth" and "data".
bool is_policy_archive(const ZipArchive& archive);

/// Parses one network of the policy: with `choice.select` "policy" the actor, with "value" the value function of an
/// actor-critic policy, else by prefixes of names. `data` states the kind of the policy and its activations: ReLU or
/// what policy_kwargs names, tanh by default for actor-critic policies, and tanh behind the actor of SAC and TD3.
/// https://stable-baselines3.readthedocs.io/en/master/guide/custom_policy.html, "Default Network Architecture".
/// @throws InputError if nothing is selected, or as parse_pth_zip().
Weights parse_policy_archive(const ZipArchive& archive, const std::string& path, const std::string& key,
                             const LayerChoice& choice);

}  // namespace swarmcert::files
