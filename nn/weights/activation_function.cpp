#include "nn/weights/activation_function.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace swarmcert::files {
namespace {

constexpr double kSeluScale = 1.0507009873554805, kSeluAlpha = 1.6732632423543772;
/// The smallest double that is at least 1.0507009873554805 * 1.6732632423543772.
constexpr double kSeluSlope = 0x1.c212cc640f031p+0;
/// The largest slope of SiLU is 1.09984, at t = 2.3994; by s'(-t) = 1 - s'(t) the least one is 1 less that.
constexpr double kSiluSlope = 0x1.1999p+0;
/// The largest slope of GELU is 1.12890, at t = sqrt 2; the least one as for SiLU.
constexpr double kGeluSlope = 0x1.211p+0;
constexpr double kHalfRoot = 0.70710678118654752440;

double relu(double t) { return t > 0 ? t : 0; }
double tanh(double t) { return std::tanh(t); }
double sigmoid(double t) { return t >= 0 ? 1 / (1 + std::exp(-t)) : std::exp(t) / (1 + std::exp(t)); }
double softplus(double t) { return relu(t) + std::log1p(std::exp(-std::fabs(t))); }
double elu(double t) { return t > 0 ? t : std::expm1(t); }
double selu(double t) { return t > 0 ? kSeluScale * t : kSeluScale * (kSeluAlpha * std::expm1(t)); }
double silu(double t) { return t * sigmoid(t); }
double gelu(double t) { return t / 2 * std::erfc(-t * kHalfRoot); }

constexpr std::array<ActivationFunction, 8> kFunctions = {{
    {Activation::kRelu, "relu", "ReLU", 0, 1, relu},
    {Activation::kTanh, "tanh", "tanh", 0, 1, tanh},
    {Activation::kSigmoid, "sigmoid", "sigmoid", 0, 0.25, sigmoid},
    {Activation::kSoftplus, "softplus", "softplus", 0, 1, softplus},
    {Activation::kElu, "elu", "ELU", 0, 1, elu},
    {Activation::kSelu, "selu", "SELU", 0, kSeluSlope, selu},
    {Activation::kSilu, "silu", "SiLU", 1 - kSiluSlope, kSiluSlope, silu},
    {Activation::kGelu, "gelu", "GELU", 1 - kGeluSlope, kGeluSlope, gelu},
}};

}  // namespace

double ActivationFunction::steepest() const { return std::max(-least_slope, greatest_slope); }

const ActivationFunction& function_of(Activation activation) {
  for (const ActivationFunction& function : kFunctions)
    if (function.activation == activation) return function;
  throw std::logic_error("function_of: no such activation");
}

std::optional<Activation> activation_called(const std::string& op) {
  for (const ActivationFunction& function : kFunctions)
    if (function.op == op) return function.activation;
  return std::nullopt;
}

std::string smooth_activations() {
  std::string names;
  for (const ActivationFunction& function : kFunctions)
    if (function.activation != Activation::kRelu)
      names += (names.empty() ? "" : ", ") + std::string(function.op);
  return names;
}

}  // namespace swarmcert::files
