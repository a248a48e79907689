#include "stability/checker/gain_bounds.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "stability/checker/fixed_point.h"

namespace swarmcert::check {
namespace {

constexpr long kMostSteps = 1 << 18;
constexpr int kTerms = 24;

Row times(const Row& row, const Square& m) {
  Row result(m.size());
  for (std::size_t j = 0; j < m.size(); ++j) {
    for (std::size_t i = 0; i < m.size(); ++i) result[j] += row[i] * m[i][j];
  }
  return result;
}

Row product(const Row& a, const Row& b) {
  Row result(a.size() + b.size() - 1);
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j < b.size(); ++j) result[i + j] += a[i] * b[j];
  }
  return result;
}

void check_ranges(const LoopWitness& loop) {
  demand(loop.input == "force" || loop.input == "command" || loop.input == "velocity" ||
             loop.input == "position",
         "input must be force, command, velocity or position");
  check_numbers(loop);
  demand(loop.delay_order >= 0 &&
             static_cast<std::size_t>(loop.delay_order) <= (loop.delay_s == 0 ? 0 : loop.lags_s.size()),
         "delay_order is out of range");
  demand(loop.time_exponent >= -64 && loop.time_exponent <= 64, "time_exponent is out of range");
  demand(loop.step_exponent >= 0 && loop.step_exponent <= 64, "step_exponent is out of range");
  demand(loop.steps >= 1 && loop.steps <= kMostSteps, "steps is out of range");
  demand(is_usual(loop.decay), "decay is out of range");
}

/// y = numerator/denominator, and the exact quantities that follow from it and P.
struct System {
  Square A, P;
  Row initial;
  Row rest_initial;    ///< of the delay expansion's remainder, before its derivatives; empty without a delay
  Rational rest_jump;  ///< its jump at 0
  Rational rest_weight;     ///< T^(k+1)/(k+1)!
  Rational settled;         ///< limit of the integral of y, in units of time
  std::array<Row, 5> rows;  ///< integral of y less `settled`, y, y', y'', y'''
};

Row numerator_of(const LoopWitness& loop, const Row& lag) {
  Row result;
  if (loop.input == "position") {
    result = {Rational(loop.Kp)};
    if (loop.Ki > 0) result.insert(result.begin(), Rational(loop.Ki));
    return result;
  }
  if (loop.input == "force") result = lag;
  if (loop.input == "command") result = {Rational(1)};
  if (loop.input == "velocity") result = {Rational(loop.Kd)};
  if (loop.input != "velocity") {
    for (Rational& x : result) x /= Rational(loop.mass_kg);
  }
  if (loop.Ki > 0) result.insert(result.begin(), Rational(0));
  return result;
}

/// Returns the state at 0+, by series division in 1/s.
/// @param a `denominator` divided by its last coefficient, in units of time of 2^-time_exponent s.
Row initial_state(const Row& numerator, const Row& denominator, const Row& a, long time_exponent) {
  const std::size_t n = a.size() - 1;
  Row initial(n);
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t power = n - 1 - k;
    if (power < numerator.size()) {
      initial[k] = numerator[power] / denominator[n] * two_to(-time_exponent * static_cast<long>(k));
    }
    for (std::size_t j = 0; j < k; ++j) initial[k] -= a[n - k + j] * initial[j];
  }
  return initial;
}

/// Adds `feedback` times the expansion of the delay to `denominator`.
/// @returns T^(k+1)/(k+1)!
Rational close_loop(const LoopWitness& loop, const Row& feedback, Row& denominator) {
  Rational term = 1;  // (-T)^j/j!
  for (int j = 0; j <= loop.delay_order; ++j) {
    if (j > 0) term *= -Rational(loop.delay_s) / j;
    for (std::size_t k = 0; k < feedback.size(); ++k)
      denominator[k + static_cast<std::size_t>(j)] += term * feedback[k];
  }
  return abs(term) * Rational(loop.delay_s) / (loop.delay_order + 1);
}

System system_of(const LoopWitness& loop) {
  Row lag = {Rational(1)};
  for (const double tau : loop.lags_s) lag = product(lag, {Rational(1), Rational(tau)});
  Row denominator = lag;
  denominator.insert(denominator.begin(), loop.Ki > 0 ? 3 : 2, Rational(0));
  Row feedback = {Rational(loop.Kp), Rational(loop.Kd)};
  if (loop.Ki > 0) feedback.insert(feedback.begin(), Rational(loop.Ki));
  System system;
  system.rest_weight = close_loop(loop, feedback, denominator);
  const Row numerator = numerator_of(loop, lag);

  const std::size_t n = order(loop);
  Row a(n + 1);
  for (std::size_t k = 0; k <= n; ++k) {
    a[k] = denominator[k] / denominator[n] * two_to(-loop.time_exponent * static_cast<long>(n - k));
  }
  system.A.assign(n, Row(n));
  for (std::size_t k = 0; k + 1 < n; ++k) system.A[k][k + 1] = 1;
  for (std::size_t k = 0; k < n; ++k) system.A[n - 1][k] = -a[k];
  system.P = exact_form(loop.P, n);
  system.initial = initial_state(numerator, denominator, a, loop.time_exponent);
  if (loop.delay_s > 0) {
    Row rest(n + 1);  // s^(k+1) feedback, less a multiple of the denominator
    for (std::size_t k = 0; k < feedback.size(); ++k)
      rest[k + static_cast<std::size_t>(loop.delay_order) + 1] = feedback[k];
    system.rest_jump = rest[n] / denominator[n];
    for (std::size_t k = 0; k <= n; ++k) rest[k] -= system.rest_jump * denominator[k];
    rest.pop_back();
    system.rest_initial = initial_state(rest, denominator, a, loop.time_exponent);
  }
  system.settled = numerator[0] / denominator[0] * two_to(loop.time_exponent);
  system.rows[0].resize(n);
  for (std::size_t k = 0; k < n; ++k) system.rows[0][k] = -a[k + 1] / a[0];
  system.rows[1].resize(n);
  system.rows[1][0] = 1;
  for (std::size_t r = 2; r < 5; ++r) system.rows[r] = times(system.rows[r - 1], system.A);
  return system;
}

void check_decay(const System& system, double decay) {
  const std::size_t n = system.A.size();
  demand(inverse_form(system.P, Row(n)).has_value(), "P is not positive definite");
  Square falls(n, Row(n));
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) {
      falls[i][j] = -2 * Rational(decay) * system.P[i][j];
      for (std::size_t k = 0; k < n; ++k) {
        falls[i][j] -= system.A[k][i] * system.P[k][j] + system.P[i][k] * system.A[k][j];
      }
    }
  }
  demand(inverse_form(falls, Row(n)).has_value(), "P does not prove that the loop decays at the stated rate");
}

/// The state at the ends of the cells, in fixed point.
class Trajectory {
 public:
  Trajectory(const System& system, const Row& initial, int step_exponent) : n_(system.A.size()) {
    Rational row_sum = 1;
    for (const Row& row : system.A) {
      Rational sum;
      for (const Rational& x : row) sum += abs(x);
      row_sum = std::max(row_sum, sum);
    }
    const Rational cell = two_to(-step_exponent);
    demand(row_sum * cell <= Rational(1, 2), "step_exponent: the cells are too long");
    Square total(n_, Row(n_));
    for (std::size_t i = 0; i < n_; ++i) total[i][i] = 1;
    Square power = total;
    Integer factorial = 1;
    for (int k = 1; k <= kTerms; ++k) {
      factorial *= k;
      for (std::size_t i = 0; i < n_; ++i) {
        power[i] = times(power[i], system.A);
        for (std::size_t j = 0; j < n_; ++j) power[i][j] *= cell / k, total[i][j] += power[i][j];
      }
    }
    factorial *= kTerms + 1;
    // The omitted terms are at most 2^-25/25! (1 + 1/2 + ...); the round-off error is below one unit per entry.
    missed_ = ceil_fixed(two_to(-kTerms) / Rational(factorial)) + static_cast<long>(n_);
    for (const Row& row : total) {
      for (const Rational& x : row) step_.push_back(floor_fixed(x));
    }
    Rational sum;
    for (const Row& row : system.P) {
      for (const Rational& x : row) sum += abs(x), P_.push_back(Integer(x * two_to(kFormBits)));
    }
    from_largest_ = fixed_root_up(sum);
    for (const Rational& x : initial) state.push_back(floor_fixed(x));
    error = times_up(from_largest_, 1);
    measure();
  }

  void advance() {
    std::vector<Integer> next(n_);
    for (std::size_t i = 0; i < n_; ++i) {
      Integer sum;
      for (std::size_t j = 0; j < n_; ++j) sum += step_[i * n_ + j] * state[j];
      next[i] = sum >> kBits;
    }
    error += times_up(from_largest_, times_up(missed_, largest) + 1);
    state = std::move(next);
    measure();
  }

  std::vector<Integer> state;
  Integer error;    ///< upper bound on |true state - state|_P
  Integer largest;  ///< max |state_i|
  Integer size;     ///< upper bound on |true state|_P

 private:
  void measure() {
    largest = 0;
    for (const Integer& x : state) largest = std::max<Integer>(largest, abs(x));
    Integer form;
    for (std::size_t i = 0; i < n_; ++i) {
      Integer sum;
      for (std::size_t j = 0; j < n_; ++j) sum += P_[i * n_ + j] * state[j];
      form += sum * state[i];
    }
    size = root_up((form >> kFormBits) + 1) + error;
  }

  std::size_t n_;
  std::vector<Integer> step_, P_;
  Integer missed_;        ///< upper bound on |exp(A cell) - step|_oo
  Integer from_largest_;  ///< |u|_P <= this times |u|_oo
};

/// A linear form of the state.
struct Form {
  std::vector<Integer> row;
  Integer norm;  ///< upper bound on sqrt(r P^-1 r')

  Form(const Row& exact, const Square& P) {
    for (const Rational& x : exact) row.push_back(floor_fixed(x));
    norm = fixed_root_up(*inverse_form(P, exact));
  }
  /// Returns an upper bound on |offset + r x|, for the true state x.
  Integer above(const Trajectory& at, const Integer& offset) const {
    Integer sum = offset << kBits;
    for (std::size_t i = 0; i < row.size(); ++i) sum += row[i] * at.state[i];
    const Integer rounding = ((static_cast<long>(row.size()) * at.largest) >> kBits) + 3;
    return (abs(sum) >> kBits) + rounding + times_up(norm, at.error);
  }
};

/// Accumulates the integral and supremum of |offset + r x|, cell by cell.
class Norms {
 public:
  Norms(const System& system, std::size_t row, const Rational& offset, int step_exponent)
      : value_(system.rows[row], system.P),
        second_(system.rows[row + 2], system.P),
        third_(system.rows[row + 3], system.P),
        offset_(floor_fixed(offset)),
        cell_(static_cast<mp_bitcnt_t>(step_exponent)) {}

  void begin(const Trajectory& at) { before_ = value_.above(at, offset_); }
  void prepare(const Trajectory& at) {
    curvature_ = second_.above(at, 0) + (times_up(third_.norm, at.size) >> cell_) + 1;
  }
  void add(const Trajectory& at) {
    const Integer now = value_.above(at, offset_);
    ends_ += before_ + now;
    curvatures_ += curvature_;
    const Integer highest = std::max(before_, now) + (curvature_ >> (2 * cell_ + 3)) + 1;
    supremum_ = std::max(supremum_, highest);
    before_ = now;
  }
  Rational supremum(const Trajectory& end) const {
    const Integer tail = abs(offset_) + 1 + times_up(value_.norm, end.size);
    return Rational(std::max(supremum_, tail)) * two_to(-static_cast<long>(kBits));
  }
  /// For an offset of 0.
  Rational integral(const Trajectory& end, double decay) const {
    const Rational cell = two_to(-static_cast<long>(cell_));
    const Rational cells = cell / 2 * ends_ + cell * cell * cell / 12 * curvatures_;
    return (cells + Rational(times_up(value_.norm, end.size)) / Rational(decay)) *
           two_to(-static_cast<long>(kBits));
  }

 private:
  Form value_, second_, third_;
  Integer offset_;
  mp_bitcnt_t cell_;
  Integer before_, curvature_, ends_, curvatures_, supremum_;
};

/// Returns an upper bound on the relative error that the expansion of the delay may cause in a response.
Rational missed_by_expansion(const System& system, const LoopWitness& loop) {
  if (loop.delay_s == 0) return 0;
  Trajectory at(system, system.rest_initial, loop.step_exponent);
  Norms rest(system, 1, 0, loop.step_exponent);
  rest.begin(at);
  for (long k = 0; k < loop.steps; ++k) {
    rest.prepare(at);
    at.advance();
    rest.add(at);
  }
  return system.rest_weight *
         (abs(system.rest_jump) + rest.integral(at, loop.decay) * two_to(-loop.time_exponent));
}

}  // namespace

std::size_t order(const LoopWitness& loop) { return loop.lags_s.size() + (loop.Ki > 0 ? 3 : 2); }

GainBounds upper_gains(const LoopWitness& loop) {
  check_ranges(loop);
  const System system = system_of(loop);
  check_decay(system, loop.decay);
  const Rational missed = missed_by_expansion(system, loop);
  demand(missed < 1, "delay_order: the expansion of the delay is too inaccurate");
  Trajectory at(system, system.initial, loop.step_exponent);
  Norms step(system, 0, system.settled, loop.step_exponent);
  Norms impulse(system, 1, 0, loop.step_exponent);
  for (Norms* const norms : {&step, &impulse}) norms->begin(at);
  for (long k = 0; k < loop.steps; ++k) {
    for (Norms* const norms : {&step, &impulse}) norms->prepare(at);
    at.advance();
    for (Norms* const norms : {&step, &impulse}) norms->add(at);
  }
  const Rational unit_s = two_to(-loop.time_exponent);
  const Rational more = 1 / (1 - missed);
  GainBounds gains;
  if (sgn(system.settled) == 0) gains.rate = step.integral(at, loop.decay) * unit_s * unit_s * more;
  gains.amplitude = impulse.integral(at, loop.decay) * unit_s * more;
  gains.edge = step.supremum(at) * unit_s * more;
  gains.impulse = impulse.supremum(at) * more;
  return gains;
}

}  // namespace swarmcert::check
