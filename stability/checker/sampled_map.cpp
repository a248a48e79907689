#include "stability/checker/sampled_map.h"

#include <optional>
#include <utility>

namespace swarmcert::check {
namespace {

constexpr int kMostPast = 8;
constexpr int kMostHalvings = 12;
constexpr int kTaylorTerms = 24;
constexpr long kMarginExponent = -60;  ///< of the contraction, as M is not known exactly

FixedRanges zeros(std::size_t rows, std::size_t columns) { return FixedRanges(rows, FixedRangeRow(columns)); }

FixedRanges product(const FixedRanges& a, const FixedRanges& b) {
  FixedRanges result = zeros(a.size(), b.front().size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t k = 0; k < b.size(); ++k) {
      if (a[i][k].lower == 0 && a[i][k].upper == 0) continue;
      for (std::size_t j = 0; j < b.front().size(); ++j) result[i][j].add_product(a[i][k], b[k][j]);
    }
  }
  return result;
}

/// Returns exp(generator t): the Taylor sum of the 2^k-th part, whose row sums are at most 1/2, squared k times.
FixedRanges exponential(const Square& generator, const Rational& t) {
  const std::size_t n = generator.size();
  Rational largest;
  for (const Row& row : generator) {
    Rational sum;
    for (const Rational& x : row) sum += abs(x);
    largest = std::max<Rational>(largest, sum * t);
  }
  int halvings = 0;
  while (largest * two_to(-halvings) > Rational(1, 2)) {
    demand(++halvings <= kMostHalvings, "lags_s: one is too short compared with period_s");
  }
  FixedRanges scaled = zeros(n, n), term = zeros(n, n);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) scaled[i][j] = FixedRange(generator[i][j] * t * two_to(-halvings));
    term[i][i] = FixedRange(Rational(1));
  }
  FixedRanges total = term;
  Integer factorial = 1;
  for (int k = 1; k <= kTaylorTerms; ++k) {
    factorial *= k;
    term = product(term, scaled);
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < n; ++j) {
        FixedRange quotient;  // by the factorial, so that division errors do not accumulate
        mpz_fdiv_q(quotient.lower.get_mpz_t(), term[i][j].lower.get_mpz_t(), factorial.get_mpz_t());
        mpz_cdiv_q(quotient.upper.get_mpz_t(), term[i][j].upper.get_mpz_t(), factorial.get_mpz_t());
        total[i][j].add(quotient);
      }
    }
  }
  factorial *= kTaylorTerms + 1;
  const Integer missed = ceil_fixed(two_to(-kTaylorTerms) / Rational(factorial));
  for (FixedRangeRow& row : total) {
    for (FixedRange& x : row) x.lower -= missed, x.upper += missed;
  }
  for (int k = 0; k < halvings; ++k) total = product(total, total);
  return total;
}

FixedRanges enclosed(const Square& exact) {
  FixedRanges result;
  for (const Row& row : exact) {
    result.emplace_back();
    for (const Rational& x : row) result.back().emplace_back(x);
  }
  return result;
}

}  // namespace

SampledLayout::SampledLayout(const SampledWitness& loop) {
  const Rational periods = Rational(loop.delay_s) / Rational(loop.period_s);
  const Integer whole = periods.get_num() / periods.get_den();
  demand(whole < kMostPast, "delay_s is too long");
  shift_s = Rational(loop.delay_s) - Rational(whole) * Rational(loop.period_s);
  plant = 2 + loop.lags_s.size();
  command = plant + (loop.Ki > 0 ? 1 : 0);
  newest = whole.get_ui();
  past = newest + (sgn(shift_s) > 0 ? 1 : 0);
}

Square control_of(const SampledWitness& loop, const SampledLayout& at) {
  Square control(at.size() + 1, Row(at.size()));
  for (std::size_t i = 0; i < at.command; ++i) control[i][i] = 1;
  const Rational Ki = loop.Ki, step = loop.integrator_step_s;
  control[at.command][0] = -(Rational(loop.Kp) + Ki * step);
  control[at.command][1] = -Rational(loop.Kd);
  if (loop.Ki > 0) control[at.plant][0] = step, control[at.command][at.plant] = -Ki;
  for (std::size_t i = 0; i < at.past; ++i) control[at.command + 1 + i][at.command + i] = 1;
  return control;
}

FixedRanges hold_of(const SampledWitness& loop, const SampledLayout& at) {
  Square generator(at.plant + 1, Row(at.plant + 1));
  generator[0][1] = generator[1][2] = 1;
  for (std::size_t i = 0; i < loop.lags_s.size(); ++i) {
    const Rational rate = 1 / Rational(loop.lags_s[i]);
    generator[2 + i][2 + i] = -rate, generator[2 + i][3 + i] = rate;
  }
  const FixedRange one(Rational(1));
  FixedRanges plant = zeros(at.plant, at.size() + 1);
  for (std::size_t i = 0; i < at.plant; ++i) plant[i][i] = one;
  const auto advance = [&](const Rational& duration_s, std::size_t command) {
    FixedRanges step = exponential(generator, duration_s), of_command = zeros(at.plant, 1);
    step.pop_back();
    for (std::size_t i = 0; i < at.plant; ++i) of_command[i][0] = step[i].back(), step[i].pop_back();
    plant = product(step, plant);
    for (std::size_t i = 0; i < at.plant; ++i) plant[i][at.command + command].add(of_command[i][0]);
  };
  if (at.past > at.newest) advance(at.shift_s, at.newest + 1);
  advance(Rational(loop.period_s) - at.shift_s, at.newest);
  FixedRanges hold = std::move(plant);
  hold.resize(at.size(), FixedRangeRow(at.size() + 1));
  if (loop.Ki > 0) hold[at.plant][at.plant] = one;
  for (std::size_t i = 0; i < at.past; ++i) hold[at.command + i][at.command + i] = one;
  return hold;
}

FixedRanges period_ranges(const FixedRanges& hold, const Square& control) {
  return product(hold, enclosed(control));
}

PeriodMap::PeriodMap(const SampledWitness& loop, FixedRanges map)
    : n(map.size()), M(std::move(map)), P(exact_form(loop.P, n)), gap(1 - Rational(loop.contraction)) {
  enclose_middle();
  measure_norm();
  check_contraction(Rational(loop.contraction) - two_to(kMarginExponent));
  const Integer unknown = times_up(
      from_largest,
      times_up(static_cast<long>(n) * spread, *std::max_element(coordinate.begin(), coordinate.end())));
  demand(as_fraction(unknown) <= two_to(kMarginExponent), "P has an entry out of range");
}

void PeriodMap::enclose_middle() {
  for (const FixedRangeRow& row : M) {
    for (const FixedRange& x : row) {
      middle.push_back(x.middle());
      spread = std::max<Integer>(spread, x.upper - x.lower + 1);
    }
  }
}

void PeriodMap::measure_norm() {
  Rational sum;
  for (const Row& row : P) {
    for (const Rational& x : row) sum += abs(x), scaled_P.push_back(Integer(x * two_to(kFormBits)));
  }
  from_largest = fixed_root_up(sum);
  for (std::size_t i = 0; i < n; ++i) {
    Row unit(n);
    unit[i] = 1;
    const std::optional<Rational> form = inverse_form(P, unit);
    demand(form.has_value(), "P is not positive definite");
    coordinate.push_back(fixed_root_up(*form));
  }
}

void PeriodMap::check_contraction(const Rational& factor) const {
  Square half(n, Row(n)), falls(n, Row(n));
  const auto m = [this](std::size_t i, std::size_t j) { return as_fraction(middle[i * n + j]); };
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) {
      for (std::size_t k = 0; k < n; ++k) half[i][j] += m(i, k) * P[k][j];
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) {
      falls[i][j] = factor * factor * P[i][j];
      for (std::size_t k = 0; k < n; ++k) falls[i][j] -= half[i][k] * m(j, k);
    }
  }
  demand(sgn(factor) > 0 && inverse_form(falls, Row(n)).has_value(),
         "P does not prove that the loop contracts as stated");
}

}  // namespace swarmcert::check
