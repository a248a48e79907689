/// @file Encoding of numbers, proofs and errors in a certificate.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "lipschitz/checker/lipschitz_lmi.h"
#include "lipschitz/checker/tree_proof.h"
#include "nn/base/json.h"

namespace swarmcert::check {

/// @throws std::runtime_error with `reason` if the condition does not hold.
void require(bool condition, const std::string& reason);

/// Reads a nonnegative number that is stored in decimal and in hex; both must denote the same double.
double number(const files::Json& decimal, const files::Json& hex, const std::string& where);

/// Reads finite hex floats from one string, separated by single spaces.
std::vector<double> hex_floats_in(const files::Json& json);

/// Reads conflicts from one string, each as "<neuron><+ or -> <neuron><+ or -> <lambda> <multiplier>"; + means on.
std::vector<Conflict> conflicts_in(const files::Json& json);

/// Reads the factor that proves a matrix positive semidefinite; nothing for null, in which case the checker computes a
/// factor itself.
std::optional<Factor> parse_factor(const files::Json& json, const std::string& where);

}  // namespace swarmcert::check
