/// @file A function of NET in the block, norm and box of a claim, evaluated in double for sampling searches. Not for
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

/// The function x -> rho(phi(x) + s) or one part of NET, including the clamp.
class SampledFunction {
 public:
  /// A difference quotient and its direction in the block, which has length 1 in units of the scale.
  struct Steepness {
    double slope = 0;
    Eigen::VectorXd direction;
  };

  /// @param domain boxes after the clamp.
  SampledFunction(const files::Network& network, const Claim& claim, Domain domain);

  Eigen::Index inputs() const { return inputs_; }
  /// Returns half the distance of the points of a difference quotient, in units of the scale.
  double half_step() const { return half_step_; }
  /// Sets half_step(). It must not exceed its initial value, for which the box has room.
  void set_half_step(double half_step) { half_step_ = half_step; }
  /// Returns the number of multiplications of one steepest().
  double work() const { return 2 * work_ * static_cast<double>(block_.size() + 1); }
  const std::vector<files::FunctionId>& other_networks() const { return other_networks_; }
  const std::vector<Eigen::VectorXd>& others() const { return others_; }

  /// Returns 0 or the centre of the box.
  Eigen::VectorXd middle() const;
  /// Returns a random point at one of several scales, inside the box or the clamp if there is one.
  Eigen::VectorXd random_point(std::mt19937_64& generator) const;
  /// Chooses random other neighbours and the ground's input; if possible, such that the network is not silent.
  void place_others(std::mt19937_64& generator);

  /// Returns the steepest difference quotient around x: along the direction of the largest gain of the Jacobian.
  Steepness steepest(const Eigen::VectorXd& x) const;
  /// Returns the gradient with respect to x of the quotient along `direction`, each coordinate in units of width().
  Eigen::VectorXd gradient(const Eigen::VectorXd& x, const Eigen::VectorXd& direction) const;
  /// Returns x + step, with the step in units of width(), projected into the box or the clamp.
  Eigen::VectorXd moved(const Eigen::VectorXd& x, const Eigen::VectorXd& step) const;
  /// Returns a direction in the block as a vector of all inputs, in their units.
  Eigen::VectorXd in_inputs(const Eigen::VectorXd& direction) const;

 private:
  /// Restricts steps to the box: removes fixed inputs from the block, limits half_step() and shrinks the box of
  /// random_point() by it, so that the points of a quotient stay inside.
  void narrow_steps(const Claim& claim);
  /// Returns the range of input k of `part`, whose box is `box`; nothing: unbounded.
  std::optional<std::pair<double, double>> interval(const files::FunctionId& part,
                                                    const std::optional<Box>& box, Eigen::Index k) const;
  Eigen::VectorXd random_point_of(const files::FunctionId& part, const std::optional<Box>& box,
                                  Eigen::Index size, std::mt19937_64& generator) const;
  void add_other(const files::FunctionId& part, std::mt19937_64& generator);
  Eigen::VectorXd evaluated(const files::FunctionId& part, const Eigen::VectorXd& x) const;
  Eigen::VectorXd term(const files::FunctionId& part, Eigen::VectorXd x) const;
  /// Returns (f(x + h d) - f(x - h d)) / (2 h) for d in the block, in units of the scale.
  Eigen::VectorXd quotient(const Eigen::VectorXd& x, const Eigen::VectorXd& direction) const;
  /// Returns the width of the box or the clamp along input k, or 1.
  double width(Eigen::Index k) const;

  const files::Network& network_;
  Domain domain_;           ///< boxes of the others
  std::optional<Box> box_;  ///< box of the moving input
  double half_step_;
  std::map<files::FunctionId, files::Evaluator<double>> evaluators_;
  files::FunctionId first_;
  std::optional<files::FunctionId> last_;
  Eigen::Index inputs_ = 0;
  bool is_silent_ = false;  ///< NET is silent among the moving neighbour and the others
  std::vector<int> block_;
  std::vector<double> scale_;
  double work_ = 0;
  std::vector<files::FunctionId> other_kinds_;  ///< networks of possible other neighbours
  std::vector<files::FunctionId> other_networks_;
  std::vector<Eigen::VectorXd> others_;
  Eigen::VectorXd others_sum_;
};

}  // namespace swarmcert::lipschitz
