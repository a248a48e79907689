/// @file The network's force on one vehicle over a box of states, enclosed between linear forms.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "lipschitz/base/box.h"
#include "lipschitz/values/reach.h"
#include "nn/weights/network.h"

namespace swarmcert::analysis {

/// Layout of a state: six numbers per neighbour (p_j - p, v_j - v), then the vehicle's own height and velocity; world
/// axes, m and m/s.
inline constexpr int kPerNeighbour = 6;
inline constexpr int kOwnState = 4;
inline int state_size(int neighbours) { return neighbours * kPerNeighbour + kOwnState; }

/// f_hat_z = unit * rho(phi_ground(own) + sum_j phi(x_j)) for a fixed number of neighbours of the vehicle's own kind,
/// as one chain of layers: the phi networks in parallel, then their sum. DeepSetForce evaluates it exactly; this
/// class encloses it.
class LearnedForce {
 public:
  /// Selects networks as stability::DeepSetForce does.
  /// @throws files::InputError as DeepSetForce, or phi networks of different depth
  ///     that cannot be brought to a common depth.
  LearnedForce(const files::Network& network, const std::string& kind, int neighbours);
  LearnedForce(const LearnedForce&) = delete;  // forms refer to its layers
  LearnedForce& operator=(const LearnedForce&) = delete;

  /// upper_row x + upper >= f_hat in newton for all x of a box, and lower_row x + lower >= -f_hat. Valid in real
  /// arithmetic: the caller must account for round-off when evaluating the forms.
  struct Forms {
    Eigen::VectorXd upper_row, lower_row;
    double upper = 0, lower = 0;
    std::shared_ptr<const lipschitz::Reach> reach;  ///< reused for parts of the box
  };
  /// @param around forms on a box that contains this one, or null.
  Forms over(const lipschitz::Box& box, const Forms* around) const;

  /// f_hat in newton: an estimate.
  double roughly(const Eigen::VectorXd& state) const;

  int states() const { return static_cast<int>(layers_.front().weights.cols()); }

 private:
  lipschitz::Box clamped(const lipschitz::Box& box) const;

  lipschitz::ReachNetwork layers_;
  lipschitz::Box clamp_;  ///< clamp on the whole state, infinite where nothing is clamped
  double newton_per_unit_ = 1;
};

}  // namespace swarmcert::analysis
