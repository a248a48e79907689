/// @file Random affine forms and the points that they contain.
#pragma once

#include <gtest/gtest.h>

#include "nn/base/random.h"
#include "stability/reach/affine_form.h"

namespace swarmcert::tests {

/// Returns a form with three symbols and a radius, about `centre`.
inline stability::AffineForm random_form(files::Random& random, double centre, double size) {
  stability::AffineForm form(centre + size * random.symmetric());
  for (int k = 0; k < 3; ++k) form.slopes.push_back(size * random.symmetric());
  form.radius = size * random.uniform();
  return form;
}

/// Returns the form's middle at the values e of the symbols.
inline long double middle(const stability::AffineForm& form, const std::vector<double>& e) {
  long double value = form.centre;
  for (std::size_t k = 0; k < form.slopes.size(); ++k)
    value += static_cast<long double>(form.slopes[k]) * e[k];
  return value;
}

/// Succeeds if the form contains `value` at the values e of the symbols. Symbols beyond e can have any value.
inline testing::AssertionResult contains(const stability::AffineForm& form, const std::vector<double>& e,
                                         long double value, double estimate_error = 0) {
  const stability::AffineForm known = form.without_symbols_from(e.size());
  const long double off = std::abs(value - middle(known, e));
  if (off <= known.radius + estimate_error) return testing::AssertionSuccess();
  return testing::AssertionFailure() << static_cast<double>(value) << " is " << static_cast<double>(off)
                                     << " off, and the radius " << known.radius;
}

}  // namespace swarmcert::tests
