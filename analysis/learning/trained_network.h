/// @file Output of a training run: weights, network.toml, certificate, models that fly it.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "analysis/learning/dataset.h"
#include "lipschitz/certify.h"

namespace swarmcert::learning {

/// Writes `phi_<kind>.safetensors`, `rho_<kind>.safetensors`, network.toml and samples.json, outputs that the trainer's
/// own arithmetic gives, into `folder`, which exists; files of these names are replaced.
/// @param silent compositions in which the network is 0 (files::Network::silent).
/// @returns the network as read back.
files::Network write_network(const LearningData& data, const training::Vector& theta,
                             const files::GammaStatement& gamma, const std::string& folder,
                             const std::vector<std::string>& silent = {});

/// Writes `model-<kind>.toml` for every kind with a rho: the model of `inputs` with the network in `folder` as one more
/// effect. With labels from published signals it has their lag (published_lag.h), so that `compare` finds the error
/// that training found. Where vehicles have models of their own, `model-<vehicle>.toml` for each of them as well, and
/// flights.toml, which names the model of every vehicle.
/// @param with_network false: the same models without the network.
void write_models(const residuals::Inputs& inputs, const training::Layout& layout, const std::string& folder,
                  bool with_network = true);

/// What is proved of a trained network.
struct Certified {
  lipschitz::Certification found;
  std::vector<std::pair<std::string, double>>
      set_bounds;  ///< "set:<phi>:<rho>": one neighbour moves; output unit/input
  lipschitz::Verdict gamma = lipschitz::Verdict::kProved;  ///< kProved if every layer is

  double largest() const;  ///< of the set bounds; 0 without any
};

/// Certifies what write_network() returned, held against samples.json where that is there, and writes certificate.json
/// beside it.
Certified write_certificate(const files::Network& network, const std::string& folder,
                            const lipschitz::CertifyOptions& options);

}  // namespace swarmcert::learning
