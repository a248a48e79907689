/// @file Encoding of numbers, proofs and errors in a certificate.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "lipschitz/checker/lipschitz_lmi.h"
#include "lipschitz/checker/tree_proof.h"
#include "nn/base/json.h"

namespace swarmcert::check {

/// @throws std::runtime_error with the reason where the condition does not hold.
void require(bool condition, const std::string& reason);

/// A nonnegative number that stands once in decimal and once in hex: both must be the same double.
double number(const files::Json& decimal, const files::Json& hex, const std::string& where);

/// Finite hex floats in one text, separated by single spaces.
std::vector<double> hex_floats_in(const files::Json& json);

/// Conflicts in one text, each as "<neuron><+ or -> <neuron><+ or -> <lambda> <multiplier>"; + is on.
std::vector<Conflict> conflicts_in(const files::Json& json);

/// What shows that a matrix is positive semidefinite; nothing for null, where the checker finds a factor itself.
std::optional<Factor> parse_factor(const files::Json& json, const std::string& where);

}  // namespace swarmcert::check
