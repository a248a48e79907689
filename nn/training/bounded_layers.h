/// @file Layers that satisfy their Lipschitz bound by construction: weights as functions of unconstrained parameters.
///
/// Rescaling after each step (spectral_normalization.h) moves the weights away from where the optimiser put them. Here
/// any parameter values give weights that satisfy the bound, and the optimiser sees the gradient through this map. Only
/// the resulting weights, an ordinary ReLU network, are stored and certified.
#pragma once

#include <vector>

#include "nn/training/layout.h"
#include "nn/weights/network.h"

namespace swarmcert::training {

/// How the weights W_1 .. W_n of a part are computed from its parameters V_1 .. V_n of the same sizes; s is the limit
/// of a layer (layer_limit(), times the part's share of it).
enum class Layers {
  /// W_k = V_k, rescaled to the limit by SpectralNormalization.
  kFree,
  /// W_k = s V_k D with D_jj = (sum_i |V_k' V_k|_ij)^(-1/2): |W_k| <= s (almost orthogonal layers, Prach and Lampert
  /// 2022).
  kAol,
  /// W_k = s Q with orthonormal columns, or orthonormal rows if there are fewer rows than columns: |W_k| = s. With V_k
  /// = [X; Y], X square, and Z = X - X' + Y'Y, Q is the Cayley transform [(I - Z) (I + Z)^-1; -2 Y (I + Z)^-1]
  /// (Trockman and Kolter 2021).
  kOrthogonal,
  /// With K_k = (I + V_k V_k')^-1, contractions C_k = 2 K_k V_k and A_k = 2 K_k - I with C_k C_k' + A_k A_k = I:
  ///    W_1 = s C_1,  W_k = s C_k A_{k-1}.
  /// Here |W_k| <= s, and the part as a whole has the Lipschitz bound s^n / 2^(n - 1). Up to positive scalings of the
  /// neurons, which commute with ReLU, these are all networks for which LipSDP-Neuron proves that bound (Wang and
  /// Manchester 2023; their second Cayley parameter is absorbed by the next layer).
  kSandwich,
};

/// Returns the product of the layers' limits over the Lipschitz bound that `count` layers satisfy by construction.
double slack_of_product(Layers layers, int count);

class BoundedLayers {
 public:
  /// @param layout must outlive this object.
  BoundedLayers(const Layout& layout, Layers layers, const files::GammaStatement& gamma);

  /// Sets the limit of every layer of each part to its share of the limit that gamma implies.
  /// @param shares one per part.
  void tighten(const std::vector<double>& shares) { shares_ = shares; }

  /// Returns the weights, rounded to float32, so the bounds hold up to rounding; the biases are those of `parameters`.
  Vector weights(const Vector& parameters) const;

  /// Transforms the gradient with respect to weights(parameters) into the gradient with respect to the parameters.
  void pull_back(const Vector& parameters, Vector& gradient) const;

 private:
  double limit_of(int part) const;
  Eigen::MatrixXd matrix_of(const Vector& theta, int part, int layer) const;
  void pull_back_sandwich(const Vector& parameters, int part, Vector& gradient) const;

  const Layout* layout_;  ///< never null; a pointer makes the class assignable
  Layers layers_;
  files::GammaStatement gamma_;
  std::vector<double> shares_;
};

}  // namespace swarmcert::training
