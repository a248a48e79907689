/// @file The force or torque that a trained deep set predicts for a vehicle among neighbours, in double precision.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "nn/deep_set.h"
#include "nn/weights/network.h"
#include "stability/effects/effect.h"

namespace swarmcert::stability {

/// Outputs that the network of a DeepSetForce may declare.
enum class DeepSetOutput {
  kForceZ,  ///< a vertical force, as used in flight
  kTorque,
  kAny,  ///< also a force vector, or a torque
};

/// Evaluates f_hat for one vehicle. Not thread-safe: it owns the scratch memory of the evaluation.
class DeepSetForce {
 public:
  /// @param kind kind of the vehicle; its rho is used, or the only rho if `network` has a single one.
  /// @param kinds the kinds that Neighbour::kind indexes; each must have a phi, unless one phi serves all kinds.
  /// @throws files::InputError if `network` is a plain network, lacks a kind, declares unknown inputs, or has an output
  ///     that `output` does not admit.
  DeepSetForce(files::Network network, const std::string& kind, const std::vector<std::string>& kinds,
               DeepSetOutput output = DeepSetOutput::kForceZ);

  /// Returns the prediction. Networks that declare no unit are in gram-force, like the published ones. A torque is
  /// predicted about the world axes and returned about the body axes. Returns 0 if the result of the evaluation is not
  /// finite.
  Wrench wrench(const Instant& now);

  /// Returns the vertical force in newton. Precondition: DeepSetOutput::kForceZ.
  double force_z_N(const Instant& now);

  /// Returns the vertical force among neighbours that fade out, composed as in the flight code (controller::predict()):
  /// the mean, over all thresholds in [0, 1], of the deep set of those neighbours whose weight is at least the
  /// threshold.
  /// @param weights [now.num_neighbours], in [0, 1].
  double force_z_N(const Instant& now, const double* weights);

  /// Returns wrench() composed in the same way.
  Wrench wrench(const Instant& now, const double* weights);

 private:
  void reserve(int neighbours);
  Eigen::Vector3d evaluate(const Instant& now);  ///< one entry per network output; SI units
  Eigen::Vector3d evaluate(const Instant& now, const double* weights);
  Wrench as_wrench(const Instant& now, const Eigen::Vector3d& output) const;

  files::Network network_;
  std::vector<files::Evaluator<double>> evaluators_;
  std::vector<nn::Mlp<double>> phi_;  ///< by index in network_.phi without the ground
  nn::Mlp<double> ground_{};
  nn::DeepSet<double> set_{};
  std::vector<int> silent_;  ///< scratch of set_
  std::vector<int> phi_of_kind_;
  std::vector<int> input_;  ///< 0..2: component of dp, 3..5: of dv
  bool is_torque_ = false;
  double SI_per_unit_ = 0;

  std::vector<double> own_, inputs_, hidden_sum_, scratch_, clamped_;
  std::vector<int> order_;
  std::vector<Neighbour> present_;  ///< those with nonzero weight
  std::vector<nn::Neighbour<double>> neighbours_;
};

}  // namespace swarmcert::stability
