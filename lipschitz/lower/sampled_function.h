/// @file A function of NET, in its claim's block, norm and box, as searches by sampling see it: in double. Not for
/// users.
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "lipschitz/base/box.h"
#include "lipschitz/base/claims.h"
#include "nn/weights/network.h"

namespace swarmcert::lipschitz {

/// x -> rho(phi(x) + s) or one part of NET, with the clamp and the map to invariants.
class SampledFunction {
 public:
  /// A difference quotient and the direction in the block that it is taken along, of length 1 in units of the scale.
  struct Steepness {
    double slope = 0;
    Eigen::VectorXd direction;
  };

  /// @param domain as it leaves the clamp. @param moved instead of the domain's box of the input that moves.
  SampledFunction(const files::Network& network, const Claim& claim, Domain domain,
                  const std::optional<Box>& moved = std::nullopt);

  Eigen::Index inputs() const { return inputs_; }
  /// Half the distance of the points of a quotient, in units of the scale.
  double half_step() const { return half_step_; }
  /// At most what it was at first: the box has no more room.
  void set_half_step(double half_step) { half_step_ = half_step; }
  /// Multiplications of one steepest().
  double work() const { return 2 * work_ * static_cast<double>(block_.size() + 1); }
  const std::vector<files::FunctionId>& other_networks() const { return other_networks_; }
  const std::vector<Eigen::VectorXd>& others() const { return others_; }

  /// 0, or the middle of the box.
  Eigen::VectorXd middle() const;
  /// A point at one of several scales, inside the box or the clamp where there is one.
  Eigen::VectorXd random_point(std::mt19937_64& generator) const;
  /// Puts other neighbours somewhere, and the ground's input; not so that the network is silent, where that can be had.
  void place_others(std::mt19937_64& generator);

  /// The steepest quotient around x: along the direction of the largest gain of the Jacobian.
  Steepness steepest(const Eigen::VectorXd& x) const;
  /// The gradient of the quotient along `direction` as a function of x, each coordinate in units of width().
  Eigen::VectorXd gradient(const Eigen::VectorXd& x, const Eigen::VectorXd& direction) const;
  /// x + step, in units of width(), put back into the box or the clamp.
  Eigen::VectorXd moved(const Eigen::VectorXd& x, const Eigen::VectorXd& step) const;
  /// d of the block as a vector of all inputs, in their units.
  Eigen::VectorXd in_inputs(const Eigen::VectorXd& direction) const;

 private:
  /// In a box points move neither along inputs that it fixes nor, with the room that random_point() leaves, out of it.
  void narrow_steps(const Claim& claim);
  /// Where input k of `part` may be, which has this box; nothing: anywhere.
  std::optional<std::pair<double, double>> interval(const files::FunctionId& part,
                                                    const std::optional<Box>& box, Eigen::Index k) const;
  Eigen::VectorXd random_point_of(const files::FunctionId& part, const std::optional<Box>& box,
                                  Eigen::Index size, std::mt19937_64& generator) const;
  void add_other(const files::FunctionId& part, std::mt19937_64& generator);
  Eigen::VectorXd evaluated(const files::FunctionId& part, const Eigen::VectorXd& x) const;
  Eigen::VectorXd term(const files::FunctionId& part, Eigen::VectorXd x) const;
  /// (f(x + h d) - f(x - h d)) / (2 h) for d in the block, in units of the scale.
  Eigen::VectorXd quotient(const Eigen::VectorXd& x, const Eigen::VectorXd& direction) const;
  /// Of the box or the clamp, or 1.
  double width(Eigen::Index k) const;

  const files::Network& network_;
  Domain domain_;           ///< of the others
  std::optional<Box> box_;  ///< of the input that moves
  double half_step_;
  std::map<files::FunctionId, files::Evaluator<double>> evaluators_;
  files::FunctionId first_;
  std::optional<files::FunctionId> last_;
  Eigen::Index inputs_ = 0;
  bool maps_ = false;       ///< to invariants, before the clamp
  bool is_silent_ = false;  ///< among the one that moves and the others
  std::vector<int> block_;
  std::vector<double> scale_;
  double work_ = 0;
  std::vector<files::FunctionId> other_kinds_;  ///< of neighbours that may stand beside the one that moves
  std::vector<files::FunctionId> other_networks_;
  std::vector<Eigen::VectorXd> others_;
  Eigen::VectorXd others_sum_;
};

}  // namespace swarmcert::lipschitz
