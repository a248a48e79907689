/// @file The normalization of observations that Stable-Baselines3 keeps beside a policy, in a file of its own.
#pragma once

#include <string>

#include "nn/weights/network.h"

namespace swarmcert::files {

/// Returns the name of "vec_normalize.pkl" or "vecnormalize.pkl" in the folder of the policy `path`; empty: neither is
/// there, or `path` is no .zip.
std::string vec_normalize_beside(const std::string& path);

/// Returns the place of `path` as seen from the folder that holds `file`.
std::string from_folder_of(const std::string& file, const std::string& path);

/// Puts the normalization that VecNormalize.save() wrote to `path` in front of the plain network f of `network`:
///   x -> f(clip((x - mean) / sqrt(var + epsilon), -clip_obs, clip_obs)).
/// The affine map is folded into the first layer; the clip becomes the input clamp, mean -+ clip_obs sqrt(var +
/// epsilon), rounded outwards to doubles. The file is added to `data_files` with its hash. The pickle is read as plain
/// data.
/// https://stable-baselines3.readthedocs.io/en/master/guide/vec_envs.html#vecnormalize
/// @throws InputError if `path` holds no such object or one of another size, or if the first layer was rounded before.
Network with_vec_normalize(Network network, const std::string& path);

}  // namespace swarmcert::files
