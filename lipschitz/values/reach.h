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

/// y = W h + b + e with any e, |e| <= bias_radius; then h = relu(y), or h = y where there is no ReLU.
struct ReachLayer {
  Eigen::MatrixXd weights;
  Eigen::VectorXd bias;
  Eigen::VectorXd bias_radius;  ///< [outputs], not negative
  bool has_relu = true;
};
using ReachNetwork = std::vector<ReachLayer>;

/// The layers of a stored network, exactly; the last one has no ReLU.
ReachNetwork reach_network(const files::Weights& weights);

/// lower <= y <= upper, entry by entry.
struct Bounds {
  Eigen::VectorXd lower, upper;
  /// The largest absolute value of each entry.
  Eigen::VectorXd magnitude() const { return lower.cwiseAbs().cwiseMax(upper.cwiseAbs()); }
};

/// value <= rows x + constants for each x of the box, entry by entry.
struct LinearForms {
  Eigen::MatrixXd rows;
  Eigen::VectorXd constants;
};

/// The largest values of linear forms over a set of inputs within a box, rounded up.
using Support = std::function<Eigen::VectorXd(const LinearForms&)>;

/// The point of the inputs at which a form is about largest: a hint.
using Steepest = std::function<Eigen::VectorXd(const LinearForms&)>;

/// Bounds on every layer over a box by backward substitution of linear relaxations of ReLU (CROWN, Zhang et al. 2018):
/// on l <= y <= u with l < 0 < u,  alpha y <= relu(y) <= s y + t  with s near u / (u - l), t = max(u - s u, -s l)
/// rounded up, alpha 0 or 1: 1 where u > -l.
///
/// Better lower slopes. A form is largest at a corner of the box. Of the neurons before, those that are on at that
/// corner get alpha = 1, the others 0, so that alpha y <= relu(y) is tight there; then the form is taken again. One
/// such step is most of what optimising alpha brings (alpha-CROWN, Xu et al. 2021), and a corner says all about it
/// (check::Decision). It is made for neurons that are nearly decided, and counts where it decides them.
///
/// Rounding. A form lambda y_j + c is exact for the lambda that is stored. Multiplying it by W_j in floating point
/// changes a coefficient by at most gamma_n |lambda| |W_j| in any order of summation, with or without fused products
/// (Higham 2002, section 3.1), hence the form by gamma_n |lambda| (|W_j| max|h|), which is added to c. Constants are
/// sums whose rounding is at most N 2^-53 times the sum of their terms' absolute values; twice that is added, which
/// also covers the rounding of these error terms themselves, and 2^-900 for underflow. Overflow ends as an infinite
/// bound.
class Reach {
 public:
  /// @param box finite, one interval per input.
  /// @param around bounds of the same network over a larger box, which hold here as well; null: none. Neurons that it
  ///   decides keep its bounds.
  /// @param slopes if not null, one matrix per layer: |slope| of the forms that bound each neuron, [outputs x inputs],
  ///   the mean of the upper and the lower one; zero for neurons that `around` decides.
  /// @param forms if not null, per layer the forms above y and then those above -y, [2 outputs x inputs]; with infinite
  ///   constants for neurons that `around` decides.
  /// @param decided if not null, better lower slopes are tried, and the neurons that they decide are added.
  Reach(const ReachNetwork& network, const Box& box, const Reach* around = nullptr,
        std::vector<Eigen::MatrixXd>* slopes = nullptr, std::vector<LinearForms>* forms = nullptr,
        std::vector<check::Decision>* decided = nullptr);

  /// Over the inputs within the box for which `support` answers, e.g. sums of outputs of another network.
  Reach(const ReachNetwork& network, const Box& box, Support support);

  /// Of a longer network over the same box: `first` are the bounds of its first layers, which are taken as they are.
  Reach(const ReachNetwork& network, const Reach& first, const Reach* around,
        std::vector<check::Decision>* decided = nullptr);

  /// Of y_k, before the ReLU of layer k.
  const Bounds& before_relu(std::size_t k) const { return bounds_[k]; }
  /// Of the network's output.
  const Bounds& output() const { return bounds_.back(); }
  const Box& box() const { return box_; }

  /// directions y_K <= rows x + constants over the box.
  LinearForms upper_forms(const Eigen::MatrixXd& directions) const;
  /// One form above direction y_K: the best of a few whose lower slopes move from those of upper_forms() towards the
  /// states of the neurons, 0 off and 1 on, at the point where the form before was largest.
  LinearForms sharpened_form(const Eigen::RowVectorXd& direction, const Steepest& steepest) const;
  /// The same with the corners of the box as such points.
  LinearForms sharpened_form(const Eigen::RowVectorXd& direction) const;
  /// The largest values of `forms` over the inputs, rounded up.
  Eigen::VectorXd largest(const LinearForms& forms) const;
  /// About the largest |d(direction y_K) / dx_k| that the bounds allow, by interval arithmetic without rounding: tells
  /// along which dimension to split, and proves nothing.
  Eigen::VectorXd influence(const Eigen::RowVectorXd& direction) const;

  /// The lines that bound the ReLUs of hidden layer j.
  ReluLines lines(std::size_t j) const;
  /// What rounding and the radius of layer j's bias cost, per unit of |lambda|.
  Eigen::VectorXd layer_error(std::size_t j) const;
  /// What rounding costs per term of a constant, relatively.
  double rounding() const { return relative_; }

 private:
  void add_layers(const Reach* around, std::vector<Eigen::MatrixXd>* slopes, std::vector<LinearForms>* forms,
                  std::vector<check::Decision>* decided);
  /// Appends the layer behind those that `layers` has.
  void append(ActiveLayers& layers) const;
  /// The first `count` layers.
  ActiveLayers active_layers(std::size_t count) const;
  /// Forms in the inputs above directions y, y leaving the layer behind `layers`.
  /// @param given_below if not null, the lower slopes of each layer's undecided neurons, [directions x neurons].
  LinearForms substituted(const ActiveLayers& layers, const Eigen::MatrixXd& directions,
                          const std::vector<Eigen::MatrixXd>* given_below = nullptr) const;
  /// The forms above y_i and then those above -y_i, i of `outputs`.
  LinearForms around_outputs(const ActiveLayers& layers, const std::vector<Eigen::Index>& outputs) const;
  /// @param forms in what the last of `layers` gives, behind its ReLU.
  /// @param error what their rounding costs.
  LinearForms pulled_back(const ActiveLayers& layers, LinearForms forms, Eigen::VectorXd error,
                          const std::vector<Eigen::MatrixXd>* given_below) const;
  /// The corners of the box where the forms are largest, [inputs x rows].
  Eigen::MatrixXd corners(const Eigen::MatrixXd& forms) const;
  /// The lower slopes of layers before `top` that are tight at the points x, [inputs x rows].
  std::vector<Eigen::MatrixXd> slopes_at(Eigen::MatrixXd x, std::size_t top) const;
  /// Tries better lower slopes for outputs `open` of the layer behind `layers`, whose forms are `found`, above y and
  /// then above -y.
  /// @param ends their largest values, improved where that decides.
  void decide(const ActiveLayers& layers, const std::vector<Eigen::Index>& open, const LinearForms& found,
              Eigen::VectorXd& ends, std::vector<check::Decision>& decided) const;

  const ReachNetwork& network_;
  double relative_ = 0;  ///< what rounding costs per term of a constant
  Box box_;
  Support support_;  ///< empty: the inputs are the box
  std::vector<Bounds> bounds_;
  std::vector<Eigen::VectorXd> term_magnitude_;  ///< |W_k| max|h_{k-1}| + |b_k| + radius
};

/// f(x) in floating point: an estimate.
Eigen::VectorXd evaluate_roughly(const ReachNetwork& network, const Eigen::VectorXd& x);

/// The two halves of `box` across dimension k.
std::pair<Box, Box> halves(const Box& box, Eigen::Index k);

}  // namespace swarmcert::lipschitz
