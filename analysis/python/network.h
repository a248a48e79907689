/// @file Networks built from arrays in memory.
#pragma once

#include <pybind11/numpy.h>

#include <string>

#include "nn/weights/network.h"

namespace swarmcert::python {

/// Builds a network from a dict with
///   "parts":       {name: {"tensors": [(name, array), ...], "order": [layer, ...], "is_chain": bool}},
///   "description": text of a network.toml whose `weights` are the names of parts; "" for one plain network with the
///                  name "network", or a pair with the names "phi" and "rho".
/// Arrays are float16 (giving a float32 network), float32 or float64, with one or two dimensions, C-contiguous.
/// `is_chain` states that the tensors are listed in the order of evaluation with ReLU between the layers. Hashes are
/// those of the safetensors files that save_network() writes.
/// @throws files::InputError as the readers of weight files do.
files::Network network_of(const pybind11::dict& source);

/// Writes parts as safetensors, and the description as network.toml, into an existing folder.
/// @return the path to load.
std::string save_network(const pybind11::dict& source, const std::string& folder, bool overwrite);

}  // namespace swarmcert::python
