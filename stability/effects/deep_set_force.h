/// @file The force or torque that a trained deep set predicts for a vehicle among neighbours, in double.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "nn/deep_set.h"
#include "nn/weights/network.h"
#include "stability/effects/effect.h"

namespace swarmcert::stability {

/// What the network of a DeepSetForce may state as its output.
enum class DeepSetOutput {
  kForceZ,  ///< a vertical force, which is what is flown
  kTorque,
  kAny,  ///< also all of a force, or a torque
};

/// f_hat of one vehicle. Not for several threads at once: it keeps the evaluation's memory.
class DeepSetForce {
 public:
  /// @param kind  of the vehicle; its rho is used, or the only rho where `network` has a single one.
  /// @param kinds Neighbour::kind is an index into this; each must have a phi, or phi must be one for all.
  /// @throws files::InputError if `network` is a plain one, lacks a kind, states inputs that it does not know, or an
  ///     output that `output` does not admit.
  DeepSetForce(files::Network network, const std::string& kind, const std::vector<std::string>& kinds,
               DeepSetOutput output = DeepSetOutput::kForceZ);

  /// The prediction; networks that state no unit are in gram-force, as the published ones. A torque is one about the
  /// axes of the world, and is returned about those of the body. 0 where the evaluation has no finite result.
  Wrench wrench(const Instant& now);

  /// The vertical force in newton. Precondition: DeepSetOutput::kForceZ.
  double force_z_N(const Instant& now);

  /// The same among neighbours that fade, as flight code composes it (controller::predict()): the mean of the deep set
  /// over all thresholds in [0, 1], of the neighbours whose weight is at least the threshold.
  /// @param weights [now.num_neighbours], in [0, 1].
  double force_z_N(const Instant& now, const double* weights);

  /// wrench(), composed likewise.
  Wrench wrench(const Instant& now, const double* weights);

 private:
  void reserve(int neighbours);
  Eigen::Vector3d evaluate(const Instant& now);  ///< as many entries as the network has outputs; SI units
  Eigen::Vector3d evaluate(const Instant& now, const double* weights);
  Wrench as_wrench(const Instant& now, const Eigen::Vector3d& output) const;

  files::Network network_;
  std::vector<files::Evaluator<double>> evaluators_;
  std::vector<nn::Mlp<double>> phi_;  ///< by index in network_.phi without the ground
  nn::Mlp<double> ground_{};
  nn::DeepSet<double> set_{};
  std::vector<int> silent_;  ///< of set_
  std::vector<int> phi_of_kind_;
  std::vector<int> input_;  ///< 0..2: component of dp, 3..5: of dv
  bool is_torque_ = false;
  double SI_per_unit_ = 0;

  std::vector<double> own_, inputs_, hidden_sum_, scratch_, clamped_;
  std::vector<int> order_;
  std::vector<Neighbour> present_;  ///< with at least some weight
  std::vector<nn::Neighbour<double>> neighbours_;
};

}  // namespace swarmcert::stability
