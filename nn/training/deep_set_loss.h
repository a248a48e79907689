/// @file Loss of a deep set over recorded samples, and its gradient.
#pragma once

#include <cstdint>

#include "nn/training/layout.h"

namespace swarmcert::training {

/// Samples of the interaction force, from all vehicles of all flights. Sample s has the inputs
/// first[s] .. first[s + 1] - 1; input i passes through part phi[i], the sum through part rho[s].
struct Dataset {
  int width = 6;                 ///< numbers stored per input: the largest input size of all phi
  int outputs = 1;               ///< components of the target per sample
  bool target_is_axial = false;  ///< with three components: the target is a torque, not a force

  std::vector<float> x;                   ///< `width` per input; entries that the part does not read are 0
  std::vector<int> phi;                   ///< per input
  std::vector<Eigen::Index> first = {0};  ///< samples + 1, ascending
  std::vector<int> rho;                   ///< per sample
  std::vector<float> target;              ///< `outputs` per sample, in the unit of the network's output
  std::vector<float> weight;              ///< per sample, nonnegative: its weight in the loss

  Eigen::Index samples() const { return static_cast<Eigen::Index>(rho.size()); }
  Eigen::Map<const Vector> target_of(Eigen::Index sample) const {
    return {target.data() + sample * outputs, outputs};
  }
  /// Adds an input to the current sample, which the next add_sample() completes.
  void add_input(int phi_part, const std::vector<float>& values);
  void add_sample(int rho_part, const std::vector<float>& force, float sample_weight = 1);
};

/// Computes the weighted sum of squared errors over some samples,
///   sum_s w_s |rho(sum_i phi(x_i)) - y_s|^2,
/// which is the paper's loss (section V-B) for w = 1.
///
/// @param samples  indices into the dataset.
/// @param gradient [layout.size()] or null: the gradient with respect to theta is added to it.
/// @returns the sum, in the target's unit squared, accumulated in double. An estimate, since the products are in
///   float32.
double deep_set_loss(const Layout& layout, const Vector& theta, const Dataset& data,
                     const Eigen::Index* samples, Eigen::Index count, Vector* gradient);

/// Returns the outputs [outputs x count] for some samples.
Matrix predict(const Layout& layout, const Vector& theta, const Dataset& data, const Eigen::Index* samples,
               Eigen::Index count);

/// Returns the outputs [outputs x columns of x] of a single part.
Matrix part_output(const Layout& layout, const Vector& theta, int part, const Matrix& x);

}  // namespace swarmcert::training
