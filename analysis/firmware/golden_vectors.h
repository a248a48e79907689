/// @file Inputs of a network and the outputs that flight code must produce for them, bit for bit.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "nn/deep_set.h"
#include "nn/weights/functions.h"
#include "nn/weights/network.h"

namespace swarmcert::firmware {

struct GoldenVector {
  int own_kind = 0;                        ///< index into Network::rho
  std::vector<float> own;                  ///< [files::kGroundInputs]
  std::vector<std::vector<float>> inputs;  ///< one per neighbour
  std::vector<int> kinds;                  ///< one per neighbour: index into files::neighbour_kinds()
  nn::DeepSetStatus status = nn::DeepSetStatus::kOk;
  float force_N = 0;
};

/// Evaluates a network as the exported source does.
class FlightEvaluator {
 public:
  /// @param network must outlive this; a deep set in which every weight is a float32.
  FlightEvaluator(const files::Network& network, int most_neighbours);

  /// Sets status and force of `vector` for a vehicle of kind `rho_kind`.
  void run(const std::string& rho_kind, GoldenVector& vector) const;

 private:
  const files::Network& network_;
  int most_;
  float scale_;
  std::map<files::FunctionId, files::Evaluator<float>> evaluators_;
  std::vector<nn::Mlp<float>> phi_;
  nn::Mlp<float> ground_{};
  bool has_ground_ = false;
  std::vector<float> lower_, upper_;
};

/// Returns newtons per unit of the network's output; gram-force if the network states no unit, as in the published
/// networks.
/// @throws files::InputError if the network states a quantity that is not a vertical force.
float newton_per_unit(const files::Network& network);

/// Returns `count` random vectors for each kind of vehicle, with 0 to `most_neighbours` neighbours. Inputs range to
/// 1.5 times the clamp of states, or +-1 m and +-2 m/s. Adds one vector for each silent composition of at most
/// `most_neighbours` neighbours. The evaluator of the flight code computes the expected outputs. Precondition: every
/// weight is a float32; the network is a deep set.
std::vector<GoldenVector> golden_vectors(const files::Network& network, int count, int most_neighbours,
                                         std::uint64_t seed);

}  // namespace swarmcert::firmware
