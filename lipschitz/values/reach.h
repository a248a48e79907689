/// @file Linear bounds on a ReLU network over a box that hold in exact arithmetic.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "lipschitz/base/box.h"
#include "lipschitz/checker/box_states.h"
#include "nn/weights/weights.h"

namespace swarmcert::lipschitz {

struct ActiveLayers;  // relu_lines.h
struct ReluLines;

/// A layer y = W h + b + e with any e, |e| <= bias_radius. The next h is relu(y), or y if there is no ReLU.
struct ReachLayer {
  Eigen::MatrixXd weights;
  Eigen::VectorXd bias;
  Eigen::VectorXd bias_radius;  ///< [outputs], not negative
  bool has_relu = true;
};
using ReachNetwork = std::vector<ReachLayer>;

/// Returns the exact layers of a stored network; the last one has no ReLU.
ReachNetwork reach_network(const files::Weights& weights);

/// lower <= y <= upper, entry by entry.
struct Bounds {
  Eigen::VectorXd lower, upper;
  /// Returns the largest absolute value of each entry.
  Eigen::VectorXd magnitude() const { return lower.cwiseAbs().cwiseMax(upper.cwiseAbs()); }
};

/// value <= rows x + constants for each x of the box, entry by entry.
struct LinearForms {
  Eigen::MatrixXd rows;
  Eigen::VectorXd constants;
};

/// Computes the largest values of linear forms over a set of inputs within a box, rounded up.
using Support = std::function<Eigen::VectorXd(const LinearForms&)>;

/// Computes an input at which a form is about largest. Used as a hint only.
using Steepest = std::function<Eigen::VectorXd(const LinearForms&)>;

/// Bounds on every layer over a box by backward substitution of linear relaxations of ReLU (CROWN, Zhang et al. 2018).
/// On l <= y <= u with l < 0 < u,  alpha y <= relu(y) <= s y + t  with s near u / (u - l), t = max(u - s u, -s l)
/// rounded up, and alpha 1 if u > -l, else 0.
///
/// Better lower slopes. A form is largest at a corner of the box. Neurons of previous layers that are on at that corner
/// get alpha = 1, the others 0, so that alpha y <= relu(y) is tight there; then the form is computed again. One such
/// step achieves most of the gain of optimising alpha (alpha-CROWN, Xu et al. 2021), and it is fully described by the
/// corner (check::Decision). It is tried for neurons that are nearly decided, and used only if it decides them.
///
/// Round-off. A form lambda y_j + c is exact for the stored lambda. Multiplying it by W_j in floating point changes a
/// coefficient by at most gamma_n |lambda| |W_j| for any order of summation, with or without fused multiply-adds
/// (Higham 2002, section 3.1), and hence the form by at most gamma_n |lambda| (|W_j| max|h|), which is added to c.
/// Constants are sums with a round-off error of at most N 2^-53 times the sum of the absolute values of their terms;
/// twice that is added, which also covers the round-off of these error terms, and 2^-900 for underflow. Overflow
/// results in an infinite bound.
class Reach {
 public:
  /// @param box finite, one interval per input.
  /// @param around bounds of the same network over a larger box, which hold here as well; null: none. Neurons decided
  ///   by them keep these bounds.
  /// @param slopes if not null, one matrix per layer: |slope| of the forms that bound each neuron, [outputs x inputs],
  ///   averaged over the upper and the lower form; zero for neurons decided by `around`.
  /// @param forms if not null, per layer the upper bounds on y, then those on -y, [2 outputs x inputs]; with infinite
  ///   constants for neurons decided by `around`.
  /// @param decided if not null, better lower slopes are tried, and the neurons that they decide are appended.
  Reach(const ReachNetwork& network, const Box& box, const Reach* around = nullptr,
        std::vector<Eigen::MatrixXd>* slopes = nullptr, std::vector<LinearForms>* forms = nullptr,
        std::vector<check::Decision>* decided = nullptr);

  /// Computes bounds over the subset of the box described by `support`, e.g. sums of outputs of another network.
  Reach(const ReachNetwork& network, const Box& box, Support support);

  /// Extends the bounds `first` of the first layers of a network to all layers, over the same box.
  Reach(const ReachNetwork& network, const Reach& first, const Reach* around,
        std::vector<check::Decision>* decided = nullptr);

  /// Returns the bounds on y_k, before the ReLU of layer k.
  const Bounds& before_relu(std::size_t k) const { return bounds_[k]; }
  /// Returns the bounds on the network's output.
  const Bounds& output() const { return bounds_.back(); }
  const Box& box() const { return box_; }

  /// Returns forms with directions y_K <= rows x + constants over the box.
  LinearForms upper_forms(const Eigen::MatrixXd& directions) const;
  /// Returns one upper bound on direction y_K: the best of a few forms whose lower slopes move from those of
  /// upper_forms() towards the states of the neurons, 0 off and 1 on, at the point where the previous form was largest.
  LinearForms sharpened_form(const Eigen::RowVectorXd& direction, const Steepest& steepest) const;
  /// The same with corners of the box as points.
  LinearForms sharpened_form(const Eigen::RowVectorXd& direction) const;
  /// Returns the largest values of `forms` over the inputs, rounded up.
  Eigen::VectorXd largest(const LinearForms& forms) const;
  /// Returns estimates of the largest |d(direction y_K) / dx_k| that the bounds allow, by interval arithmetic without
  /// directed rounding. Used only to choose the dimension to split.
  Eigen::VectorXd influence(const Eigen::RowVectorXd& direction) const;

  /// Returns the lines that bound the ReLUs of hidden layer j.
  ReluLines lines(std::size_t j) const;
  /// Returns the error per unit of |lambda| due to round-off and to the bias radius of layer j.
  Eigen::VectorXd layer_error(std::size_t j) const;
  /// Returns the relative round-off error per term of a constant.
  double rounding() const { return relative_; }

 private:
  void add_layers(const Reach* around, std::vector<Eigen::MatrixXd>* slopes, std::vector<LinearForms>* forms,
                  std::vector<check::Decision>* decided);
  /// Appends the next layer to `layers`.
  void append(ActiveLayers& layers) const;
  /// Returns the first `count` layers.
  ActiveLayers active_layers(std::size_t count) const;
  /// Returns upper bounds on directions y as forms in the inputs, where y is the output of the layer behind `layers`.
  /// @param given_below if not null, the lower slopes of each layer's undecided neurons, [directions x neurons].
  LinearForms substituted(const ActiveLayers& layers, const Eigen::MatrixXd& directions,
                          const std::vector<Eigen::MatrixXd>* given_below = nullptr) const;
  /// Returns the upper bounds on y_i, then those on -y_i, for i in `outputs`.
  LinearForms around_outputs(const ActiveLayers& layers, const std::vector<Eigen::Index>& outputs) const;
  /// Substitutes forms back to the inputs.
  /// @param forms forms in the output of the last of `layers`, after its ReLU.
  /// @param error bounds on their round-off errors.
  LinearForms pulled_back(const ActiveLayers& layers, LinearForms forms, Eigen::VectorXd error,
                          const std::vector<Eigen::MatrixXd>* given_below) const;
  /// Returns the corners of the box where the forms are largest, [inputs x rows].
  Eigen::MatrixXd corners(const Eigen::MatrixXd& forms) const;
  /// Returns the lower slopes of layers before `top` that are tight at the points x, [inputs x rows].
  std::vector<Eigen::MatrixXd> slopes_at(Eigen::MatrixXd x, std::size_t top) const;
  /// Tries better lower slopes for outputs `open` of the layer behind `layers`. `found` contains the upper bounds on y,
  /// then those on -y.
  /// @param ends the largest values of these forms; improved if that decides a neuron.
  void decide(const ActiveLayers& layers, const std::vector<Eigen::Index>& open, const LinearForms& found,
              Eigen::VectorXd& ends, std::vector<check::Decision>& decided) const;

  const ReachNetwork& network_;
  double relative_ = 0;  ///< relative round-off error per term of a constant
  Box box_;
  Support support_;  ///< empty: the inputs are the whole box
  std::vector<Bounds> bounds_;
  std::vector<Eigen::VectorXd> term_magnitude_;  ///< |W_k| max|h_{k-1}| + |b_k| + radius
};

/// Returns f(x) in floating point: an estimate.
Eigen::VectorXd evaluate_roughly(const ReachNetwork& network, const Eigen::VectorXd& x);

/// Returns the two halves of `box` along dimension k.
std::pair<Box, Box> halves(const Box& box, Eigen::Index k);

}  // namespace swarmcert::lipschitz
