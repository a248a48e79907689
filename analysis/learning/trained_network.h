/// @file Output of a training run: weights, network.toml, certificate, and models that use the network.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "analysis/learning/dataset.h"
#include "lipschitz/certify.h"

namespace swarmcert::learning {

/// Writes `phi_<kind>.safetensors`, `rho_<kind>.safetensors`, network.toml and samples.json (outputs computed with
/// the trainer's own arithmetic) into `folder`, which must exist; files of these names are replaced.
/// @param silent compositions in which the network is 0 (files::Network::silent).
/// @returns the network as read back.
files::Network write_network(const LearningData& data, const training::Vector& theta,
                             const files::GammaStatement& gamma, const std::string& folder,
                             const std::vector<std::string>& silent = {});

/// Writes `model-<kind>.toml` for every kind with a rho: the model of `inputs` with the network in `folder` as an
/// additional effect. With labels from published signals the model has the lag of these signals (published_lag.h), so
/// that `compare` reproduces the error found in training. If vehicles have individual models, it also writes
/// `model-<vehicle>.toml` for each of them and a flights.toml that names the model of every vehicle.
/// @param with_network false: the same models without the network.
void write_models(const residuals::Inputs& inputs, const training::Layout& layout, const std::string& folder,
                  bool with_network = true);

/// Proved properties of a trained network.
struct Certified {
  lipschitz::Certification found;
  std::vector<std::pair<std::string, double>>
      set_bounds;  ///< "set:<phi>:<rho>" as one neighbour moves; output unit/input
  lipschitz::Verdict gamma = lipschitz::Verdict::kProved;  ///< kProved if every layer keeps gamma

  double largest() const;  ///< largest set bound; 0 if there is none
};

/// Certifies the network returned by write_network(), compares it with samples.json if present, and writes
/// certificate.json into `folder`.
Certified write_certificate(const files::Network& network, const std::string& folder,
                            const lipschitz::CertifyOptions& options);

}  // namespace swarmcert::learning
