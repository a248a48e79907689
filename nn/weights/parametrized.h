/// @file Weights that PyTorch computes from other tensors at every call: spectral_norm and weight_norm.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "nn/weights/tensors.h"

namespace swarmcert::files {

/// Tensors with every parametrized weight replaced by the one that it stands for.
struct EffectiveTensors {
  struct Computed {
    std::vector<double> numbers;  ///< the nearest doubles
    double rounding = 0;          ///< Frobenius norm of what they miss at most
  };
  std::vector<DeclaredTensor> tensors;
  std::vector<std::size_t> sources;          ///< index among the given tensors; of computed ones unused
  std::map<std::size_t, Computed> computed;  ///< by index into `tensors`
  std::vector<std::string> notes;
};

/// spectral_norm, old style (weight_orig, weight_u, weight_v) and new (parametrizations.weight.original, 0._u, 0._v):
/// W / (u' W v) with the stored u and v, as PyTorch evaluates it after eval().
/// weight_norm over the outputs, old style (weight_g, weight_v) and new (original0, original1): row i is g_i v_i /
/// |v_i|.
/// @throws InputError where one of these tensors is missing, has another shape or is not finite, or the divisor is 0.
EffectiveTensors effective_tensors(const std::vector<DeclaredTensor>& tensors, const TensorReader& read,
                                   const std::string& path);

}  // namespace swarmcert::files
