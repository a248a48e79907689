/// @file Layers that keep their Lipschitz bound by construction: weights as functions of what the optimiser moves.
///
/// Rescaling after each step (spectral_normalization.h) moves the weights away from where the optimiser put them. Here
/// every value of the parameters gives weights that keep the bound, and the optimiser sees the gradient through that
/// map. What is stored and certified are the weights, an ordinary ReLU network.
#pragma once

#include <vector>

#include "nn/training/layout.h"
#include "nn/weights/network.h"

namespace swarmcert::training {

/// How the weights W_1 .. W_n of a part follow from its parameters V_1 .. V_n of the same sizes; s is the limit of a
/// layer (layer_limit(), times the part's share of it).
enum class Layers {
  /// W_k = V_k, rescaled to the limit by SpectralNormalization.
  kFree,
  /// W_k = s V_k D, D_jj = (sum_i |V_k' V_k|_ij)^(-1/2): |W_k| <= s (almost orthogonal layers, Prach and Lampert
  /// 2022).
  kAol,
  /// W_k = s Q with orthonormal columns, or rows where there are fewer rows: |W_k| = s. With V_k = [X; Y], X square,
  /// and Z = X - X' + Y'Y, the Cayley transform Q = [(I - Z) (I + Z)^-1; -2 Y (I + Z)^-1] (Trockman and Kolter 2021).
  kOrthogonal,
  /// With K_k = (I + V_k V_k')^-1, contractions C_k = 2 K_k V_k and A_k = 2 K_k - I, for which C_k C_k' + A_k A_k = I:
  ///   W_1 = s C_1,  W_k = s C_k A_{k-1}.
  /// |W_k| <= s, and the part as a whole has the Lipschitz bound s^n / 2^(n - 1): up to factors of the neurons, which
  /// ReLU lets pass, these are all networks of which LipSDP-Neuron proves it (Wang and Manchester 2023, whose second
  /// Cayley parameter the next layer takes in).
  kSandwich,
};

/// Product of the layers' limits over the Lipschitz bound that a part of `count` layers keeps by construction.
double slack_of_product(Layers layers, int count);

class BoundedLayers {
 public:
  /// @param layout must outlive it.
  BoundedLayers(const Layout& layout, Layers layers, const files::GammaStatement& gamma);

  /// From now on the limit of every layer of a part is its share of gamma's. @param shares one per part.
  void tighten(const std::vector<double>& shares) { shares_ = shares; }

  /// The weights, rounded to float32, so that bounds hold up to rounding; biases are those of `parameters`.
  Vector weights(const Vector& parameters) const;

  /// Turns the gradient with respect to weights(parameters) into that with respect to the parameters.
  void pull_back(const Vector& parameters, Vector& gradient) const;

 private:
  double limit_of(int part) const;
  Eigen::MatrixXd matrix_of(const Vector& theta, int part, int layer) const;
  void pull_back_sandwich(const Vector& parameters, int part, Vector& gradient) const;

  const Layout* layout_;  ///< never null; a pointer so that values can be assigned
  Layers layers_;
  files::GammaStatement gamma_;
  std::vector<double> shares_;
};

}  // namespace swarmcert::training
