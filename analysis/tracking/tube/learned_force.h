/// @file The network's force on one vehicle over a box of states, between linear forms.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "lipschitz/base/box.h"
#include "lipschitz/values/reach.h"
#include "nn/weights/network.h"

namespace swarmcert::analysis {

/// Places in a state: six numbers per neighbour (p_j - p, v_j - v), then the vehicle's own height and velocity; world
/// axes, m and m/s.
inline constexpr int kPerNeighbour = 6;
inline constexpr int kOwnState = 4;
inline int state_size(int neighbours) { return neighbours * kPerNeighbour + kOwnState; }

/// f_hat_z = unit * rho(phi_ground(own) + sum_j phi(x_j)) among a fixed number of neighbours of the vehicle's own kind,
/// as one chain of layers: the phi side by side, then their sum. Evaluated exactly by DeepSetForce; here enclosed.
class LearnedForce {
 public:
  /// Networks are chosen as stability::DeepSetForce does.
  /// @throws files::InputError as DeepSetForce, if the network has invariants, and if its phi differ in depth and
  ///   cannot be brought to one.
  LearnedForce(const files::Network& network, const std::string& kind, int neighbours);
  LearnedForce(const LearnedForce&) = delete;  // forms refer to its layers
  LearnedForce& operator=(const LearnedForce&) = delete;

  /// upper_row x + upper >= f_hat in newton for all x of a box, and lower_row x + lower >= -f_hat. In real arithmetic:
  /// what rounding may cost when the forms are evaluated is the caller's.
  struct Forms {
    Eigen::VectorXd upper_row, lower_row;
    double upper = 0, lower = 0;
    std::shared_ptr<const lipschitz::Reach> reach;  ///< for parts of the box
  };
  /// @param around of a box that contains this one, or null.
  Forms over(const lipschitz::Box& box, const Forms* around) const;

  /// f_hat in newton: an estimate.
  double roughly(const Eigen::VectorXd& state) const;

  int states() const { return static_cast<int>(layers_.front().weights.cols()); }
  double newton_per_unit() const { return newton_per_unit_; }
  /// The set functions of a neighbour and, if there is one, of the ground.
  const files::FunctionId& neighbour_function() const { return neighbour_function_; }
  const std::optional<files::FunctionId>& ground_function() const { return ground_function_; }
  /// Which component of (dp, dv) each input of phi is.
  const std::vector<int>& input_components() const { return components_; }

 private:
  lipschitz::Box clamped(const lipschitz::Box& box) const;

  lipschitz::ReachNetwork layers_;
  lipschitz::Box clamp_;  ///< of the whole state, infinite where nothing is clamped
  std::vector<int> components_;
  files::FunctionId neighbour_function_;
  std::optional<files::FunctionId> ground_function_;
  double newton_per_unit_ = 1;
};

}  // namespace swarmcert::analysis
