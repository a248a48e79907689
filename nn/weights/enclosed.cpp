#include "nn/weights/enclosed.h"

#include <cmath>
#include <limits>

namespace swarmcert::files {
namespace {

/// Covers the round-off of up to 2^25 operations on nonnegative numbers.
constexpr double kUp = 1.0 + 0x1p-26;
constexpr double kUlp = 0x1p-53;  ///< relative error bound of one operation rounded to nearest
constexpr double kLeast = std::numeric_limits<double>::denorm_min();
/// Below this magnitude the error of a product or quotient may not be representable as a double.
constexpr double kTiny = 0x1p-960;

double rounding_of(double value) { return std::fabs(value) * kUlp + kLeast; }

}  // namespace

Enclosed times(const Enclosed& a, const Enclosed& b) {
  ExactSum sum;
  sum.add_product(a, b);
  return sum.value();
}

Enclosed divided(const Enclosed& a, const Enclosed& b) {
  const double quotient = a.value / b.value;
  const bool is_exact = a.value == 0 || (std::fabs(quotient) >= kTiny && std::fabs(a.value) >= kTiny &&
                                         std::fma(quotient, b.value, -a.value) == 0);
  double radius = is_exact ? 0 : rounding_of(quotient);
  // |a/b - a'/b'| <= (|a - a'| + |a'/b'| |b - b'|) / |b|, and |b| >= |b'| - |b - b'|.
  if (a.radius > 0 || b.radius > 0) {
    const double divisor = (std::fabs(b.value) - b.radius) * (1 - 4 * kUlp);
    const double exact_quotient = std::fabs(quotient) + rounding_of(quotient);
    radius = (radius + (a.radius + exact_quotient * b.radius) / divisor) * kUp + kLeast;
  }
  return {quotient, radius};
}

Enclosed square_root(const Enclosed& a) {
  const double root = std::sqrt(a.value);
  const bool is_exact = a.value == 0 || (a.value >= kTiny && std::fma(root, root, -a.value) == 0);
  double radius = is_exact ? 0 : rounding_of(root);
  // |sqrt(a) - sqrt(a')| <= |a - a'| / sqrt(a'), and <= sqrt(|a - a'|) where a' = 0.
  if (a.radius > 0)
    radius = (radius + (root > 0 ? a.radius / (root * (1 - kUlp)) : std::sqrt(a.radius))) * kUp + kLeast;
  return {root, radius};
}

void ExactSum::clear() {
  parts_.clear();
  radius_ = 0;
}

void ExactSum::add_exactly(double x) {
  std::size_t kept = 0;
  for (double part : parts_) {
    if (std::fabs(x) < std::fabs(part)) std::swap(x, part);
    const double sum = x + part;
    const double error = part - (sum - x);
    if (error != 0) parts_[kept++] = error;
    x = sum;
  }
  parts_.resize(kept);
  if (x != 0) parts_.push_back(x);
}

void ExactSum::add(const Enclosed& a) {
  add_exactly(a.value);
  if (a.radius > 0) radius_ = (radius_ + a.radius) * (1 + 2 * kUlp);
}

void ExactSum::add_product(const Enclosed& a, const Enclosed& b) {
  const double product = a.value * b.value;
  const double error = std::fma(a.value, b.value, -product);
  add_exactly(product);
  if (error != 0) add_exactly(error);
  double radius = 0;
  if (a.radius > 0 || b.radius > 0)
    radius =
        (std::fabs(a.value) * b.radius + std::fabs(b.value) * a.radius + a.radius * b.radius) * kUp + kLeast;
  if (std::fabs(product) < kTiny && a.value != 0 && b.value != 0) radius += 2 * kLeast;
  if (radius > 0) radius_ = (radius_ + radius) * (1 + 2 * kUlp);
}

Enclosed ExactSum::value() const {
  if (parts_.empty()) return {0, radius_};
  // Summed in descending order of magnitude up to the first addition that rounds. Its error, part - (next - sum), is a
  // double. The remaining parts are smaller than that error; they decide the rounding if it is half a unit in the last
  // place.
  double sum = 0, error = 0;
  std::size_t left = parts_.size();
  while (left > 0 && error == 0) {
    const double part = parts_[--left], next = sum + part;
    error = part - (next - sum);
    sum = next;
  }
  double rest = std::fabs(error);
  for (std::size_t i = left; i-- > 0;) rest += std::fabs(parts_[i]);
  if (left > 0 && (error < 0) == (parts_[left - 1] < 0)) {
    const double further = sum + 2 * error;
    if (further - sum == 2 * error) sum = further;
  }
  const double radius = rest > 0 || radius_ > 0 ? (rest + radius_) * kUp + kLeast : 0;
  return {sum, radius};
}

double norm_up(const std::vector<double>& numbers) {
  double largest = 0;
  for (const double number : numbers) largest = std::fmax(largest, std::fabs(number));
  if (!(largest > 0) || !std::isfinite(largest)) return largest;
  double sum = 0;
  for (const double number : numbers) sum += (number / largest) * (number / largest);
  return largest * std::sqrt(sum * kUp) * kUp + kLeast;
}

}  // namespace swarmcert::files
