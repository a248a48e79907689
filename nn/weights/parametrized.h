/// @file Weights that PyTorch recomputes from other tensors at every call: spectral_norm and weight_norm.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "nn/weights/tensors.h"

namespace swarmcert::files {

/// The tensors of a file, with every parametrized weight replaced by its effective value.
struct EffectiveTensors {
  struct Computed {
    std::vector<double> numbers;  ///< rounded to nearest
    double rounding = 0;          ///< upper bound on the Frobenius norm of the rounding errors
  };
  std::vector<DeclaredTensor> tensors;
  std::vector<std::size_t> sources;          ///< index among the given tensors; unused for computed ones
  std::map<std::size_t, Computed> computed;  ///< keyed by index into `tensors`
  std::vector<std::string> notes;
  std::vector<std::string> unused;  ///< see Weights::unused
};

/// Computes effective weights. spectral_norm, old style (weight_orig, weight_u, weight_v) and new
/// (parametrizations.weight.original, 0._u, 0._v): W / (u' W v) with the stored u and v, as PyTorch evaluates it after
/// eval(). Files of PyTorch before 0.4.1 hold no v, but the weight itself, which is taken. weight_norm over outputs,
/// old style (weight_g, weight_v) and new (original0, original1): row i is g_i v_i / |v_i|.
/// @throws InputError if one of these tensors is missing, has another shape or is not finite, or if the divisor is 0.
EffectiveTensors effective_tensors(const std::vector<DeclaredTensor>& tensors, const TensorReader& read,
                                   const std::string& path);

}  // namespace swarmcert::files
