#include "nn/weights/activation_function.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

namespace swarmcert::files {
namespace {

constexpr double kSeluScale = 1.0507009873554805, kSeluAlpha = 1.6732632423543772;
/// The smallest double that is at least 1.0507009873554805 * 1.6732632423543772.
constexpr double kSeluSlope = 0x1.c212cc640f031p+0;
/// The largest slope of SiLU is 1.09984, at t = 2.3994; since s'(-t) = 1 - s'(t), the smallest is 1 minus that.
constexpr double kSiluSlope = 0x1.1999p+0;
/// The largest slope of GELU is 1.12890, at t = sqrt 2; the smallest follows as for SiLU.
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

double (*const kSorts)(double) = nullptr;

std::vector<ActivationFunction> all_functions() {
  std::vector<ActivationFunction> all = {
      {Activation::kRelu, "relu", "ReLU", 0, 1, relu},
      {Activation::kTanh, "tanh", "tanh", 0, 1, tanh},
      {Activation::kSigmoid, "sigmoid", "sigmoid", 0, 0.25, sigmoid},
      {Activation::kSoftplus, "softplus", "softplus", 0, 1, softplus},
      {Activation::kElu, "elu", "ELU", 0, 1, elu},
      {Activation::kSelu, "selu", "SELU", 0, kSeluSlope, selu},
      {Activation::kSilu, "silu", "SiLU", 1 - kSiluSlope, kSiluSlope, silu},
      {Activation::kGelu, "gelu", "GELU", 1 - kGeluSlope, kGeluSlope, gelu},
      {Activation::kMaxMinHalves, "maxmin:halves", "MaxMin of halves", 0, 1, kSorts, 2},
      {Activation::kMaxMinPairs, "maxmin:pairs", "MaxMin of pairs", 0, 1, kSorts, 2},
  };
  for (int size = 2; size <= kLargestGroup; ++size) {
    const std::string number = std::to_string(size);
    all.push_back({group_sort(size), "groupsort:" + number, "GroupSort of " + number, 0, 1, kSorts, size});
  }
  return all;
}

const std::vector<ActivationFunction>& functions() {
  static const std::vector<ActivationFunction> all = all_functions();
  return all;
}

}  // namespace

Activation group_sort(int size) {
  if (size < 2 || size > kLargestGroup)
    throw std::invalid_argument("group_sort: groups hold 2 to " + std::to_string(kLargestGroup) + " numbers");
  return static_cast<Activation>(static_cast<int>(Activation::kGroupSort) + size);
}

double ActivationFunction::steepest() const { return std::max(-least_slope, greatest_slope); }

const ActivationFunction& function_of(Activation activation) {
  for (const ActivationFunction& function : functions())
    if (function.activation == activation) return function;
  throw std::logic_error("function_of: no such activation");
}

std::vector<double> activated(Activation activation, std::vector<double> layer) {
  const ActivationFunction& function = function_of(activation);
  if (function.sorts()) return rearranged(activation, std::move(layer));
  for (double& t : layer) t = function.value(t);
  return layer;
}

std::optional<Activation> activation_called(const std::string& op) {
  for (const ActivationFunction& function : functions())
    if (function.op == op) return function.activation;
  return std::nullopt;
}

std::string smooth_activations() {
  std::string names;
  for (const ActivationFunction& function : functions())
    if (function.activation != Activation::kRelu && function.activation < Activation::kGroupSort)
      names += (names.empty() ? "" : ", ") + function.op;
  return names + ", groupsort:SIZE";
}

}  // namespace swarmcert::files
