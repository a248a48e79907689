#include "lipschitz/values/invariant_box.h"

#include <cmath>

#include "lipschitz/base/rounding.h"
#include "nn/weights/function_id.h"

namespace swarmcert::lipschitz {
namespace {

using check::Dyadic;

struct Interval {
  Dyadic lower, upper;
};

Interval operator+(const Interval& a, const Interval& b) { return {a.lower + b.lower, a.upper + b.upper}; }

/// c x for c > 0.
Interval operator*(double c, const Interval& x) { return {Dyadic(c) * x.lower, Dyadic(c) * x.upper}; }

/// Of x^2.
Interval square(const Interval& x) {
  const Dyadic a = x.lower * x.lower, b = x.upper * x.upper;
  const bool holds_zero = x.lower.sign() <= 0 && x.upper.sign() >= 0;
  return {holds_zero ? Dyadic() : a >= b ? b : a, a >= b ? a : b};
}

/// The largest double that is at most the root.
double sqrt_down(const Dyadic& square) {
  const double root = sqrt_up(square);
  return Dyadic(root) * root >= square && square >= Dyadic(root) * root ? root : std::nextafter(root, 0.0);
}

void add(const Interval& x, Box& box) {
  box.lower.push_back(rounded_down(x.lower));
  box.upper.push_back(rounded_up(x.upper));
}

void add_norm(const Interval& x, const Interval& y, Box& box) {
  const Interval sum = square(x) + square(y);
  box.lower.push_back(sqrt_down(sum.lower));
  box.upper.push_back(sqrt_up(sum.upper));
}

}  // namespace

Box invariant_box(const files::FunctionId& part, const Box& states) {
  const auto at = [&states](std::size_t k) { return Interval{states.lower[k], states.upper[k]}; };
  Box box;
  if (part.is_ground_phi()) {
    add(at(0), box);
    add_norm(at(1), at(2), box);
    add(at(3), box);
    return box;
  }
  add_norm(at(0), at(1), box);
  add(1.5 * at(2), box);
  add_norm(at(3), at(4), box);
  add(1.5 * at(5), box);
  add_norm(at(0) + 0.5 * at(3), at(1) + 0.5 * at(4), box);
  return box;
}

Domain invariant_boxes(const Domain& states) {
  Domain boxes;
  for (const auto& [part, box] : states) boxes[part] = invariant_box(part, box);
  return boxes;
}

}  // namespace swarmcert::lipschitz
