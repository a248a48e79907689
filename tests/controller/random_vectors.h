/// @file Random vectors and rotations for property tests; the same sequence on every platform.
#pragma once

#include <cmath>
#include <random>

#include "controller/linear_algebra.h"

namespace swarmcert::controller::tests {

/// Uniform in [lower, upper]; std::uniform_real_distribution may differ between libraries.
inline double uniform(std::mt19937& generator, double lower, double upper) {
  return lower + (upper - lower) * (static_cast<double>(generator()) / 4294967295.0);
}

inline Vector3<double> random_vector(std::mt19937& generator, double largest) {
  const double x = uniform(generator, -largest, largest), y = uniform(generator, -largest, largest);
  return {x, y, uniform(generator, -largest, largest)};
}

inline Vector3<double> random_unit_vector(std::mt19937& generator) {
  for (;;) {
    const Vector3<double> v = random_vector(generator, 1.0);
    const double length = norm(v);
    if (length > 0.1 && length <= 1.0) return divided(v, length);
  }
}

/// Rodrigues' formula: returns the rotation by `angle_rad` about the unit vector `axis`.
inline Matrix3<double> rotation(const Vector3<double>& axis, double angle_rad) {
  const auto column = [&](const Vector3<double>& e) {
    return scaled(std::cos(angle_rad), e) + scaled(std::sin(angle_rad), cross(axis, e)) +
           scaled((1.0 - std::cos(angle_rad)) * dot(axis, e), axis);
  };
  return from_columns(column({1, 0, 0}), column({0, 1, 0}), column({0, 0, 1}));
}

template <typename To, typename From>
Vector3<To> cast(const Vector3<From>& v) {
  return {static_cast<To>(v.x), static_cast<To>(v.y), static_cast<To>(v.z)};
}

template <typename To, typename From>
Matrix3<To> cast(const Matrix3<From>& m) {
  return {cast<To>(m.x), cast<To>(m.y), cast<To>(m.z)};
}

inline double largest_entry(const Vector3<double>& v) {
  return std::fmax(std::fabs(v.x), std::fmax(std::fabs(v.y), std::fabs(v.z)));
}

inline double largest_entry(const Matrix3<double>& m) {
  return std::fmax(largest_entry(m.x), std::fmax(largest_entry(m.y), largest_entry(m.z)));
}

inline Matrix3<double> difference(const Matrix3<double>& a, const Matrix3<double>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}

}  // namespace swarmcert::controller::tests
