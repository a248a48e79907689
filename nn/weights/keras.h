/// @file Keras models saved as HDF5 (.h5) or as an archive (.keras).
#pragma once

#include <string>

#include "nn/weights/weights.h"
#include "nn/weights/zip_archive.h"

namespace swarmcert::files {

/// Parses the network in an HDF5 file that Keras wrote: `model.save("net.h5")` states its layers, their order and their
/// activations in `model_config`; `save_weights` states the order of registration only. Layers other than Dense, those
/// that are the identity when the model is evaluated, and activations are refused.
/// @throws InputError with the layer for anything else.
Weights parse_keras(const std::string& bytes, const std::string& path, const LayerChoice& choice);

/// Returns whether the archive holds "config.json" and "model.weights.h5".
bool is_keras_archive(const ZipArchive& archive);

/// Parses a model that Keras 3 saved as .keras: the same layers, stated by "config.json".
/// @throws InputError as parse_keras().
Weights parse_keras_archive(const ZipArchive& archive, const std::string& path, const LayerChoice& choice);

}  // namespace swarmcert::files
