/// @file Three-dimensional vectors and matrices: plain data, sums in the order x, y, z, no heap.
#pragma once

#include <cstddef>

#include "controller/scalar.h"

namespace swarmcert::controller {

template <typename Scalar>
struct Vector3 {
  Scalar x{}, y{}, z{};

  /// Returns component `axis`: 0, 1, 2 for x, y, z.
  constexpr const Scalar& operator[](std::size_t axis) const { return axis == 0 ? x : axis == 1 ? y : z; }
  constexpr Scalar& operator[](std::size_t axis) { return axis == 0 ? x : axis == 1 ? y : z; }
};

template <typename Scalar>
inline Vector3<Scalar> operator+(const Vector3<Scalar>& a, const Vector3<Scalar>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}

template <typename Scalar>
inline Vector3<Scalar> operator-(const Vector3<Scalar>& a, const Vector3<Scalar>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}

template <typename Scalar>
inline Vector3<Scalar> operator-(const Vector3<Scalar>& a) {
  return {-a.x, -a.y, -a.z};
}

template <typename Scalar>
inline Vector3<Scalar> scaled(const Scalar& factor, const Vector3<Scalar>& a) {
  return {product(factor, a.x), product(factor, a.y), product(factor, a.z)};
}

/// Returns (a_x b_x, a_y b_y, a_z b_z): the product of the diagonal matrix diag(a) with b.
template <typename Scalar>
inline Vector3<Scalar> diagonal_product(const Vector3<Scalar>& a, const Vector3<Scalar>& b) {
  return {product(a.x, b.x), product(a.y, b.y), product(a.z, b.z)};
}

template <typename Scalar>
inline Scalar dot(const Vector3<Scalar>& a, const Vector3<Scalar>& b) {
  return product(a.x, b.x) + product(a.y, b.y) + product(a.z, b.z);
}

template <typename Scalar>
inline Vector3<Scalar> cross(const Vector3<Scalar>& a, const Vector3<Scalar>& b) {
  return {product(a.y, b.z) - product(a.z, b.y), product(a.z, b.x) - product(a.x, b.z),
          product(a.x, b.y) - product(a.y, b.x)};
}

template <typename Scalar>
inline Scalar norm(const Vector3<Scalar>& a) {
  return square_root(dot(a, a));
}

template <typename Scalar>
inline Vector3<Scalar> divided(const Vector3<Scalar>& a, const Scalar& divisor) {
  return {a.x / divisor, a.y / divisor, a.z / divisor};
}

template <typename Scalar>
inline bool is_finite(const Vector3<Scalar>& a) {
  return is_finite(a.x) && is_finite(a.y) && is_finite(a.z);
}

/// Returns true if no entry exceeds `limit` in magnitude; false if an entry is NaN.
template <typename Scalar>
inline bool is_within(const Vector3<Scalar>& a, Scalar limit) {
  return absolute(a.x) <= limit && absolute(a.y) <= limit && absolute(a.z) <= limit;
}

/// A matrix with rows x, y, z. A rotation R_AB maps coordinates in B to those in A; its columns are the axes of B.
template <typename Scalar>
struct Matrix3 {
  Vector3<Scalar> x, y, z;

  /// Returns row `row`: m[i][j] is the entry in row i and column j.
  constexpr const Vector3<Scalar>& operator[](std::size_t row) const {
    return row == 0 ? x : row == 1 ? y : z;
  }
  constexpr Vector3<Scalar>& operator[](std::size_t row) { return row == 0 ? x : row == 1 ? y : z; }
};

template <typename Scalar>
inline Matrix3<Scalar> diagonal(const Vector3<Scalar>& d) {
  const Scalar zero(0);
  return {{d.x, zero, zero}, {zero, d.y, zero}, {zero, zero, d.z}};
}

template <typename Scalar>
inline Matrix3<Scalar> identity() {
  return diagonal(Vector3<Scalar>{Scalar(1), Scalar(1), Scalar(1)});
}

template <typename Scalar>
inline Matrix3<Scalar> transpose(const Matrix3<Scalar>& a) {
  return {{a.x.x, a.y.x, a.z.x}, {a.x.y, a.y.y, a.z.y}, {a.x.z, a.y.z, a.z.z}};
}

template <typename Scalar>
inline Matrix3<Scalar> from_columns(const Vector3<Scalar>& x, const Vector3<Scalar>& y,
                                    const Vector3<Scalar>& z) {
  return transpose(Matrix3<Scalar>{x, y, z});
}

template <typename Scalar>
inline Matrix3<Scalar> scaled(const Scalar& factor, const Matrix3<Scalar>& a) {
  return {scaled(factor, a.x), scaled(factor, a.y), scaled(factor, a.z)};
}

/// Returns the third column. For a rotation R_WB this is the body's z axis, the thrust direction, in W.
template <typename Scalar>
inline Vector3<Scalar> z_axis(const Matrix3<Scalar>& a) {
  return {a.x.z, a.y.z, a.z.z};
}

template <typename Scalar>
inline Vector3<Scalar> operator*(const Matrix3<Scalar>& a, const Vector3<Scalar>& v) {
  return {dot(a.x, v), dot(a.y, v), dot(a.z, v)};
}

template <typename Scalar>
inline Matrix3<Scalar> operator*(const Matrix3<Scalar>& a, const Matrix3<Scalar>& b) {
  const Matrix3<Scalar> columns = transpose(b);
  return transpose(Matrix3<Scalar>{a * columns.x, a * columns.y, a * columns.z});
}

template <typename Scalar>
inline Scalar trace(const Matrix3<Scalar>& a) {
  return a.x.x + a.y.y + a.z.z;
}

template <typename Scalar>
inline bool is_finite(const Matrix3<Scalar>& a) {
  return is_finite(a.x) && is_finite(a.y) && is_finite(a.z);
}

/// Returns true if |R'R - I| <= tolerance in every entry and det R > 0; false if an entry is NaN.
template <typename Scalar>
inline bool is_rotation(const Matrix3<Scalar>& r, Scalar tolerance) {
  const Matrix3<Scalar> gram = transpose(r) * r;
  const Vector3<Scalar> x{gram.x.x - Scalar(1), gram.x.y, gram.x.z};
  const Vector3<Scalar> y{gram.y.x, gram.y.y - Scalar(1), gram.y.z};
  const Vector3<Scalar> z{gram.z.x, gram.z.y, gram.z.z - Scalar(1)};
  return is_within(x, tolerance) && is_within(y, tolerance) && is_within(z, tolerance) &&
         dot(cross(r.x, r.y), r.z) > Scalar(0);
}

}  // namespace swarmcert::controller
