#include "lipschitz/checker/witness.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>

#include "lipschitz/checker/values.h"
#include "nn/weights/compositions.h"
#include "nn/weights/functions.h"

namespace swarmcert::lipschitz {
namespace {

/// A vector with entries integers[i] * 2^exponent. Finite doubles are dyadic, and a ReLU network maps dyadic vectors to
/// dyadic vectors.
struct DyadicVector {
  std::vector<mpz_class> integers;
  long exponent = 0;
};

/// Returns the exponent of the lowest set bit of x, which is finite and not 0.
long lowest_bit(double x) {
  int exponent = 0;
  const auto mantissa = static_cast<long long>(std::ldexp(std::frexp(x, &exponent), 53));
  return exponent - 53 + __builtin_ctzll(static_cast<unsigned long long>(mantissa));
}

void shift_left(mpz_class& integer, long bits) {
  mpz_mul_2exp(integer.get_mpz_t(), integer.get_mpz_t(), static_cast<mp_bitcnt_t>(bits));
}

DyadicVector exactly(const std::vector<double>& values) {
  DyadicVector result;
  bool first = true;
  for (const double value : values) {
    if (value == 0) continue;
    result.exponent = first ? lowest_bit(value) : std::min(result.exponent, lowest_bit(value));
    first = false;
  }
  for (const double value : values) {
    if (value == 0) {
      result.integers.emplace_back(0);
      continue;
    }
    const long own = lowest_bit(value);
    int exponent = 0;
    const double fraction = std::frexp(value, &exponent);
    // A double with an integral value below 2^53: the conversion is exact.
    result.integers.emplace_back(std::ldexp(fraction, static_cast<int>(exponent - own)));
    shift_left(result.integers.back(), own - result.exponent);
  }
  return result;
}

/// Brings a and b to the smaller of their exponents.
void align(DyadicVector& a, DyadicVector& b) {
  if (a.exponent < b.exponent) {
    align(b, a);
    return;
  }
  for (mpz_class& integer : a.integers) shift_left(integer, a.exponent - b.exponent);
  a.exponent = b.exponent;
}

void add(DyadicVector& sum, DyadicVector term) {
  align(sum, term);
  for (std::size_t i = 0; i < sum.integers.size(); ++i) sum.integers[i] += term.integers[i];
}

DyadicVector apply(const files::Layer& layer, const DyadicVector& x) {
  const DyadicVector weights = exactly(layer.weights);
  DyadicVector y;
  y.integers.resize(static_cast<std::size_t>(layer.outputs));
  y.exponent = weights.exponent + x.exponent;
  for (int i = 0; i < layer.outputs; ++i) {
    const std::size_t row = static_cast<std::size_t>(i) * layer.inputs;
    mpz_class& sum = y.integers[i];
    for (int j = 0; j < layer.inputs; ++j) {
      mpz_addmul(sum.get_mpz_t(), weights.integers[row + j].get_mpz_t(), x.integers[j].get_mpz_t());
    }
  }
  add(y, exactly(layer.biases));
  return y;
}

/// Evaluates a ReLU network exactly.
DyadicVector evaluate(const files::Weights& network, DyadicVector x) {
  if (!network.is_relu()) throw std::invalid_argument("only ReLU networks are evaluated in integers");
  for (std::size_t k = 0; k < network.layers.size(); ++k) {
    x = apply(network.layers[k], x);
    if (k + 1 == network.layers.size()) break;
    for (mpz_class& integer : x.integers) {
      if (sgn(integer) < 0) integer = 0;
    }
  }
  return x;
}

/// Returns the input of the term's network for x: x after the clamp.
std::vector<double> seen(const Term& term, const std::vector<float>& x) {
  std::vector<double> clamped(x.begin(), x.end());
  if (term.clamp != nullptr) {
    for (std::size_t k = 0; k < x.size(); ++k) {
      clamped[k] = std::clamp(clamped[k], term.clamp->lower[k], term.clamp->upper[k]);
    }
  }
  return clamped;
}

DyadicVector evaluate(const Term& term, const std::vector<float>& x) {
  return evaluate(*term.network, exactly(seen(term, x)));
}

/// Returns the value before rho: moved(x) + sum of the others.
DyadicVector evaluate(const SlopeFunction& f, const std::vector<float>& x, const DyadicVector* others_sum) {
  DyadicVector value = evaluate(f.moved, x);
  if (others_sum != nullptr) add(value, *others_sum);
  return f.rho == nullptr ? value : evaluate(*f.rho, std::move(value));
}

/// integer 2^exponent.
mpq_class scaled(const mpz_class& integer, long exponent) {
  mpq_class result(integer);
  if (exponent >= 0) {
    mpq_mul_2exp(result.get_mpq_t(), result.get_mpq_t(), static_cast<mp_bitcnt_t>(exponent));
  } else {
    mpq_div_2exp(result.get_mpq_t(), result.get_mpq_t(), static_cast<mp_bitcnt_t>(-exponent));
  }
  return result;
}

/// |a - b|_2^2 as a rational number.
mpq_class squared_distance(DyadicVector a, DyadicVector b) {
  align(a, b);
  mpz_class sum = 0;
  for (std::size_t i = 0; i < a.integers.size(); ++i) {
    const mpz_class difference = a.integers[i] - b.integers[i];
    sum += difference * difference;
  }
  return scaled(sum, 2 * a.exponent);
}

using check::Dyadic;
using check::Intervals;

/// Encloses the term's value at x.
Intervals enclosed(const Term& term, const std::vector<float>& x) {
  Intervals at;
  for (const double coordinate : seen(term, x)) at.lower.emplace_back(coordinate);
  at.upper = at.lower;
  return check::network_intervals(*term.network, std::move(at));
}

/// Encloses f(x).
/// @param terms the terms that do not move.
Intervals enclosed(const SlopeFunction& f, const std::vector<float>& x, std::vector<check::SumTerm> terms) {
  Intervals value = enclosed(f.moved, x);
  if (f.rho == nullptr) return value;
  terms.push_back({{std::move(value)}, 1, 1});
  return check::network_intervals(*f.rho,
                                  check::sum_intervals(terms, static_cast<std::size_t>(f.rho->inputs())));
}

/// Returns a lower bound on |a - b|_2^2 for all a and b in their enclosures.
mpq_class least_squared_distance(const Intervals& a, const Intervals& b) {
  Dyadic sum;
  for (std::size_t i = 0; i < a.lower.size(); ++i) {
    const Dyadic least = std::max<Dyadic>(a.lower[i] - b.upper[i], b.lower[i] - a.upper[i]);
    if (least.sign() > 0) sum += least * least;
  }
  return scaled(sum.mantissa, sum.exponent);
}

/// Returns |f(x) - f(y)|_2^2 for a ReLU function, exactly.
mpq_class exact_rise(const SlopeFunction& f, const SlopePoints& points) {
  DyadicVector others_sum;
  for (std::size_t j = 0; j < f.others.size(); ++j) {
    DyadicVector value = evaluate(f.others[j], points.others[j]);
    if (j == 0) {
      others_sum = std::move(value);
    } else {
      add(others_sum, std::move(value));
    }
  }
  const DyadicVector* const sum = f.others.empty() ? nullptr : &others_sum;
  return squared_distance(evaluate(f, points.x, sum), evaluate(f, points.y, sum));
}

/// Returns a lower bound on |f(x) - f(y)|_2^2.
mpq_class least_rise(const SlopeFunction& f, const SlopePoints& points) {
  std::vector<check::SumTerm> others;
  for (std::size_t j = 0; j < f.others.size(); ++j)
    others.push_back({{enclosed(f.others[j], points.others[j])}, 1, 1});
  return least_squared_distance(enclosed(f, points.x, others), enclosed(f, points.y, others));
}

[[noreturn]] void refuse(const std::string& what) { throw std::invalid_argument("slope: " + what); }

void check_term(const Term& term, const std::string& name) {
  if (term.network == nullptr || term.network->layers.empty()) refuse(name + " has no network");
  if (term.clamp == nullptr) return;
  const std::size_t inputs = static_cast<std::size_t>(term.network->inputs());
  if (term.clamp->lower.size() != inputs || term.clamp->upper.size() != inputs) {
    refuse("the clamp of " + name + " needs " + std::to_string(inputs) + " intervals");
  }
  for (std::size_t k = 0; k < inputs; ++k) {
    if (!(term.clamp->lower[k] <= term.clamp->upper[k]) || std::isinf(term.clamp->lower[k]) ||
        std::isinf(term.clamp->upper[k])) {
      refuse("clamp interval " + std::to_string(k) + " of " + name + " is empty or not finite");
    }
  }
}

void check_point(const std::vector<float>& x, const Term& term, const std::string& name) {
  if (x.size() != static_cast<std::size_t>(term.network->inputs())) {
    refuse(name + " has " + std::to_string(x.size()) + " coordinates, its network takes " +
           std::to_string(term.network->inputs()));
  }
  for (const float value : x) {
    if (!std::isfinite(value)) refuse(name + " has a coordinate that is not finite");
  }
}

}  // namespace

bool is_relu(const SlopeFunction& f) {
  return f.moved.network->is_relu() && (f.rho == nullptr || f.rho->is_relu()) &&
         std::all_of(f.others.begin(), f.others.end(),
                     [](const Term& other) { return other.network->is_relu(); });
}

void check_function(const SlopeFunction& f) {
  check_term(f.moved, "the moved term");
  if (f.rho == nullptr) {
    if (!f.others.empty()) refuse("terms can only be summed in front of a rho");
    return;
  }
  if (f.rho->layers.empty()) refuse("rho has no layers");
  if (f.moved.network->outputs() != f.rho->inputs()) refuse("the moved term does not fit rho");
  for (std::size_t j = 0; j < f.others.size(); ++j) {
    const std::string name = "other term " + std::to_string(j);
    check_term(f.others[j], name);
    if (f.others[j].network->outputs() != f.rho->inputs()) refuse(name + " does not fit rho");
  }
}

double sqrt_down(const mpq_class& square) {
  if (sgn(square) < 0)
    throw std::invalid_argument("sqrt_down: square = " + square.get_str() + " is negative");
  if (sgn(square) == 0) return 0;
  // With an even shift s, floor(sqrt(floor(square * 2^s))) * 2^(-s/2) <= sqrt(square). With about 110 bits before the
  // root, the root has more than the 53 bits that are kept.
  mpz_class n = square.get_num();
  mpz_class d = square.get_den();
  const long bits = static_cast<long>(mpz_sizeinbase(n.get_mpz_t(), 2)) -
                    static_cast<long>(mpz_sizeinbase(d.get_mpz_t(), 2));
  const long half_shift = (112 - bits) / 2;
  if (half_shift >= 0) {
    shift_left(n, 2 * half_shift);
  } else {
    shift_left(d, -2 * half_shift);
  }
  const mpz_class root = sqrt(mpz_class(n / d));
  long exponent = 0;
  const double fraction = mpz_get_d_2exp(&exponent, root.get_mpz_t());  // truncates
  exponent -= half_shift;
  double result = std::numeric_limits<double>::max();
  if (exponent <= 1024) result = std::ldexp(fraction, static_cast<int>(std::max(exponent, -2000L)));
  // Only ldexp into the subnormal range can round up; the check covers any other error as well.
  while (mpq_class(result) * mpq_class(result) > square) result = std::nextafter(result, 0.0);
  return result;
}

SlopeFunction slope_function(const files::Network& network, const files::FunctionId& function,
                             const std::vector<files::FunctionId>& others) {
  const files::Parts parts = files::parts(network);
  const std::vector<files::FunctionId> names = function.parts();
  std::vector<files::FunctionId> neighbours = others;
  neighbours.push_back(names[0]);
  if (files::is_silent_among(network, function, neighbours))
    refuse(function.name() + " is 0 among these neighbours");
  const auto term = [&](const files::FunctionId& name) {
    const bool clamped = network.clamp && files::is_clamped(name);
    return Term{parts.at(name), clamped ? &*network.clamp : nullptr};
  };
  SlopeFunction f{term(names[0]), {}, names.size() == 2 ? parts.at(names[1]) : nullptr};
  const files::FunctionId ground = files::FunctionId::ground_phi();
  std::size_t grounds = names[0] == ground ? 1 : 0;
  for (const files::FunctionId& part : others) {
    if (!part.is_phi()) refuse(part.name() + " is not a neighbour");
    grounds += part == ground ? 1 : 0;
    f.others.push_back(term(part));
  }
  if (names.size() == 2 && grounds != parts.count(ground)) {
    refuse("the ground network enters the sum exactly once");
  }
  return f;
}

std::vector<mpq_class> value(const files::Network& network, const files::FunctionId& function,
                             const std::vector<files::FunctionId>& networks,
                             const std::vector<std::vector<float>>& points) {
  const files::Parts parts = files::parts(network);
  const std::vector<files::FunctionId> names = function.parts();
  if (names.size() == 1 && networks.size() != 1) refuse("a plain network needs exactly one point");
  if (networks.size() != points.size()) refuse("there must be one point per network");
  DyadicVector sum;
  sum.integers.resize(static_cast<std::size_t>(parts.at(names[0])->outputs()));
  for (std::size_t j = 0; j < points.size(); ++j) {
    const bool clamped = network.clamp && files::is_clamped(networks[j]);
    const Term term{parts.at(networks[j]), clamped ? &*network.clamp : nullptr};
    check_point(points[j], term, "point " + std::to_string(j));
    add(sum, evaluate(term, points[j]));
  }
  if (files::is_silent_among(network, function, networks))
    return std::vector<mpq_class>(static_cast<std::size_t>(parts.at(names[1])->outputs()));
  if (names.size() == 2) sum = evaluate(*parts.at(names[1]), std::move(sum));
  std::vector<mpq_class> result;
  for (const mpz_class& integer : sum.integers) result.push_back(scaled(integer, sum.exponent));
  return result;
}

mpq_class slope_squared(const SlopeFunction& f, const SlopePoints& points, const std::vector<int>& block,
                        const std::vector<double>& scale) {
  check_function(f);
  check_point(points.x, f.moved, "x");
  check_point(points.y, f.moved, "y");
  if (points.others.size() != f.others.size()) {
    refuse(std::to_string(points.others.size()) + " fixed points for " + std::to_string(f.others.size()) +
           " terms");
  }
  const int inputs = f.moved.network->inputs();
  std::vector<bool> may_move(static_cast<std::size_t>(inputs), block.empty());
  for (const int k : block) {
    if (k < 0 || k >= inputs) refuse("block coordinate " + std::to_string(k) + " does not exist");
    may_move[k] = true;
  }
  for (int k = 0; k < inputs; ++k) {
    if (!may_move[k] && points.x[k] != points.y[k]) {
      refuse("x and y differ in coordinate " + std::to_string(k) + ", which is not in the block");
    }
  }
  if (points.x == points.y) refuse("x == y");

  for (std::size_t j = 0; j < f.others.size(); ++j)
    check_point(points.others[j], f.others[j], "fixed point " + std::to_string(j));
  const mpq_class rise = is_relu(f) ? exact_rise(f, points) : least_rise(f, points);
  if (!scale.empty() && scale.size() != points.x.size()) refuse("scale needs one number per input");
  mpq_class run = 0;
  for (std::size_t k = 0; k < points.x.size(); ++k) {
    mpq_class step =
        mpq_class(static_cast<double>(points.x[k])) - mpq_class(static_cast<double>(points.y[k]));
    if (!scale.empty()) {
      if (!(scale[k] > 0) || std::isinf(scale[k])) refuse("scale is not positive");
      step /= mpq_class(scale[k]);
    }
    run += step * step;
  }
  return rise / run;
}

LowerBound slope(const SlopeFunction& f, const SlopePoints& points, const std::vector<int>& block,
                 const std::vector<double>& scale) {
  return LowerBound(sqrt_down(slope_squared(f, points, block, scale)));
}

}  // namespace swarmcert::lipschitz
