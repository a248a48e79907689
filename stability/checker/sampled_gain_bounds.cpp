#include "stability/checker/sampled_gain_bounds.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "stability/checker/fixed_point.h"

namespace swarmcert::check {
namespace {

constexpr long kMostPeriods = 1 << 18;
constexpr std::size_t kMostSampledLags = 4;
constexpr int kMostPast = 8;
constexpr int kMostHalvings = 12;
constexpr int kTaylorTerms = 24;
constexpr long kMarginExponent = -60;  ///< of the contraction, for what M is not known exactly

/// A number between two fixed-point numbers.
struct Range {
  Integer lo, hi;

  Range() = default;
  explicit Range(const Rational& x) : lo(floor_fixed(x)), hi(ceil_fixed(x)) {}
  explicit Range(const Integer& fixed) : lo(fixed), hi(fixed) {}
  void add(const Range& other) { lo += other.lo, hi += other.hi; }
  void add_product(const Range& a, const Range& b) {
    const std::array<Integer, 4> ends = {a.lo * b.lo, a.lo * b.hi, a.hi * b.lo, a.hi * b.hi};
    lo += *std::min_element(ends.begin(), ends.end()) >> kBits;
    hi += (*std::max_element(ends.begin(), ends.end()) >> kBits) + 1;
  }
  Integer middle() const { return (lo + hi) >> 1; }
  Integer magnitude() const { return std::max<Integer>(abs(lo), abs(hi)); }
};
using RangeRow = std::vector<Range>;
using Ranges = std::vector<RangeRow>;

Ranges zeros(std::size_t rows, std::size_t columns) { return Ranges(rows, RangeRow(columns)); }

Ranges product(const Ranges& a, const Ranges& b) {
  Ranges result = zeros(a.size(), b.front().size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t k = 0; k < b.size(); ++k) {
      if (a[i][k].lo == 0 && a[i][k].hi == 0) continue;
      for (std::size_t j = 0; j < b.front().size(); ++j) result[i][j].add_product(a[i][k], b[k][j]);
    }
  }
  return result;
}

/// exp(generator t): the Taylor sum of the 2^k-th part, whose rows sum to at most 1/2, squared k times.
Ranges exponential(const Square& generator, const Rational& t) {
  const std::size_t n = generator.size();
  Rational largest;
  for (const Row& row : generator) {
    Rational sum;
    for (const Rational& x : row) sum += abs(x);
    largest = std::max<Rational>(largest, sum * t);
  }
  int halvings = 0;
  while (largest * two_to(-halvings) > Rational(1, 2)) {
    demand(++halvings <= kMostHalvings, "lags_s: one is too short against period_s");
  }
  Ranges scaled = zeros(n, n), term = zeros(n, n);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) scaled[i][j] = Range(generator[i][j] * t * two_to(-halvings));
    term[i][i] = Range(Rational(1));
  }
  Ranges total = term;
  Integer factorial = 1;
  for (int k = 1; k <= kTaylorTerms; ++k) {
    factorial *= k;
    term = product(term, scaled);
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < n; ++j) {
        Range quotient;  // by the factorial, so that no division adds up
        mpz_fdiv_q(quotient.lo.get_mpz_t(), term[i][j].lo.get_mpz_t(), factorial.get_mpz_t());
        mpz_cdiv_q(quotient.hi.get_mpz_t(), term[i][j].hi.get_mpz_t(), factorial.get_mpz_t());
        total[i][j].add(quotient);
      }
    }
  }
  factorial *= kTaylorTerms + 1;
  const Integer missed = ceil_fixed(two_to(-kTaylorTerms) / Rational(factorial));
  for (RangeRow& row : total) {
    for (Range& x : row) x.lo -= missed, x.hi += missed;
  }
  for (int k = 0; k < halvings; ++k) total = product(total, total);
  return total;
}

/// Which state stands where, before the control of a period: e, e', lags' outputs, the integral, past commands (newest
/// first). After it the new command stands before the past ones.
struct Layout {
  std::size_t plant = 0, command = 0, past = 0, newest = 0;
  Rational shift_s;  ///< part of a period for which the older command still acts

  explicit Layout(const SampledWitness& loop) {
    const Rational periods = Rational(loop.delay_s) / Rational(loop.period_s);
    const Integer whole = periods.get_num() / periods.get_den();
    demand(whole < kMostPast, "delay_s is too long");
    shift_s = Rational(loop.delay_s) - Rational(whole) * Rational(loop.period_s);
    plant = 2 + loop.lags_s.size();
    command = plant + (loop.Ki > 0 ? 1 : 0);
    newest = whole.get_ui();
    past = newest + (sgn(shift_s) > 0 ? 1 : 0);
  }
  std::size_t size() const { return command + past; }
};

void check_numbers(const SampledWitness& loop) {
  demand(
      is_usual(loop.mass_kg) && is_usual(loop.Kp) && is_usual(loop.Kd) && (loop.Ki == 0 || is_usual(loop.Ki)),
      "mass_kg, Kp, Kd or Ki is out of range");
  demand(
      loop.lags_s.size() <= kMostSampledLags && std::all_of(loop.lags_s.begin(), loop.lags_s.end(), is_usual),
      "lags_s are more than four, or out of range");
  demand(loop.delay_s == 0 || is_usual(loop.delay_s), "delay_s is out of range");
  demand(is_usual(loop.period_s) && is_usual(loop.integrator_step_s),
         "period_s or integrator_step_s is out of range");
}

void check_witness(const SampledWitness& loop) {
  demand(loop.steps >= 1 && loop.steps <= kMostPeriods, "steps is out of range");
  demand(loop.contraction >= 0x1p-10 && loop.contraction <= 1 - 0x1p-40, "contraction is out of range");
}

/// State before -> after control, [size + 1 x size].
Square control_of(const SampledWitness& loop, const Layout& at) {
  Square control(at.size() + 1, Row(at.size()));
  for (std::size_t i = 0; i < at.command; ++i) control[i][i] = 1;
  const Rational Ki = loop.Ki, step = loop.integrator_step_s;
  control[at.command][0] = -(Rational(loop.Kp) + Ki * step);
  control[at.command][1] = -Rational(loop.Kd);
  if (loop.Ki > 0) control[at.plant][0] = step, control[at.command][at.plant] = -Ki;
  for (std::size_t i = 0; i < at.past; ++i) control[at.command + 1 + i][at.command + i] = 1;
  return control;
}

/// State after control -> before that of the next period, [size x size + 1].
Ranges hold_of(const SampledWitness& loop, const Layout& at) {
  Square generator(at.plant + 1, Row(at.plant + 1));
  generator[0][1] = generator[1][2] = 1;
  for (std::size_t i = 0; i < loop.lags_s.size(); ++i) {
    const Rational rate = 1 / Rational(loop.lags_s[i]);
    generator[2 + i][2 + i] = -rate, generator[2 + i][3 + i] = rate;
  }
  const Range one(Rational(1));
  Ranges plant = zeros(at.plant, at.size() + 1);
  for (std::size_t i = 0; i < at.plant; ++i) plant[i][i] = one;
  const auto advance = [&](const Rational& duration_s, std::size_t command) {
    Ranges step = exponential(generator, duration_s), of_command = zeros(at.plant, 1);
    step.pop_back();
    for (std::size_t i = 0; i < at.plant; ++i) of_command[i][0] = step[i].back(), step[i].pop_back();
    plant = product(step, plant);
    for (std::size_t i = 0; i < at.plant; ++i) plant[i][at.command + command].add(of_command[i][0]);
  };
  if (at.past > at.newest) advance(at.shift_s, at.newest + 1);
  advance(Rational(loop.period_s) - at.shift_s, at.newest);
  Ranges hold = std::move(plant);
  hold.resize(at.size(), RangeRow(at.size() + 1));
  if (loop.Ki > 0) hold[at.plant][at.plant] = one;
  for (std::size_t i = 0; i < at.past; ++i) hold[at.command + i][at.command + i] = one;
  return hold;
}

Ranges enclosed(const Square& exact) {
  Ranges result;
  for (const Row& row : exact) {
    result.emplace_back();
    for (const Rational& x : row) result.back().emplace_back(x);
  }
  return result;
}

/// The map from one period to the next, and the norm |r| = sqrt(r P r') of rows over its states.
struct Map {
  std::size_t n = 0;
  Ranges M;
  std::vector<Integer> middle;  ///< of M, row by row
  Integer spread;               ///< M is within this of `middle`
  Square P;
  std::vector<Integer> scaled_P;    ///< over 2^kFormBits
  Integer from_largest;             ///< |r| <= this times the largest |r_i|
  std::vector<Integer> coordinate;  ///< |r_i| <= this times |r|
  Rational gap;                     ///< 1 - contraction

  Map(const SampledWitness& loop, const Layout& at, const Ranges& hold, const Square& control)
      : n(at.size()),
        M(product(hold, enclosed(control))),
        P(exact_form(loop.P, n)),
        gap(1 - Rational(loop.contraction)) {
    for (const RangeRow& row : M) {
      for (const Range& x : row) {
        middle.push_back(x.middle());
        spread = std::max<Integer>(spread, x.hi - x.lo + 1);
      }
    }
    Rational sum;
    for (const Row& row : P) {
      for (const Rational& x : row) sum += abs(x), scaled_P.push_back(Integer(x * two_to(kFormBits)));
    }
    from_largest = fixed_root_up(sum);
    Integer largest;
    for (std::size_t i = 0; i < n; ++i) {
      Row unit(n);
      unit[i] = 1;
      const std::optional<Rational> form = inverse_form(P, unit);
      demand(form.has_value(), "P is not positive definite");
      coordinate.push_back(fixed_root_up(*form));
      largest = std::max(largest, coordinate.back());
    }
    check_contraction(Rational(loop.contraction) - two_to(kMarginExponent));
    const Integer unknown = times_up(from_largest, times_up(static_cast<long>(n) * spread, largest));
    demand(as_fraction(unknown) <= two_to(kMarginExponent), "P has an entry out of range");
  }

 private:
  void check_contraction(const Rational& factor) const {
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
           "P does not show that the loop contracts as stated");
  }
};

/// A row that goes back period by period.
class Backwards {
 public:
  Backwards(const Map& map, const Row& row) : map_(map), next_(map.n) {
    for (const Rational& x : row) state.push_back(floor_fixed(x));
    error = times_up(map_.from_largest, 1);
    measure();
  }
  void advance() {
    for (std::size_t j = 0; j < map_.n; ++j) {
      Integer& sum = next_[j];
      sum = 0;
      for (std::size_t i = 0; i < map_.n; ++i) sum += state[i] * map_.middle[i * map_.n + j];
      sum >>= kBits;
    }
    const Integer unknown = static_cast<long>(map_.n) * map_.spread;
    error += times_up(map_.from_largest, times_up(unknown, largest) + 1);
    state.swap(next_);
    measure();
  }

  std::vector<Integer> state;
  Integer error;    ///< at least |true row - state|
  Integer largest;  ///< max |state_i|
  Integer size;     ///< at least |true row|

 private:
  void measure() {
    largest = 0;
    Integer form, sum;
    for (std::size_t i = 0; i < map_.n; ++i) {
      if (largest < abs(state[i])) largest = abs(state[i]);
      sum = 0;
      for (std::size_t j = 0; j < map_.n; ++j) sum += map_.scaled_P[i * map_.n + j] * state[j];
      form += sum * state[i];
    }
    size = root_up((form >> kFormBits) + 1) + error;
  }

  const Map& map_;
  std::vector<Integer> next_;
};

/// A column that rows are multiplied with.
struct Column {
  std::vector<Integer> at;
  Integer norm;  ///< |r at| <= norm |r|
  Integer off;   ///< the true column differs from `at` by at most this in that sense
  Integer most;  ///< norm + off

  Column() = default;
  Column(const Map& map, std::vector<Integer> middle, Integer unknown)
      : at(std::move(middle)), off(std::move(unknown)) {
    Row exact;
    for (const Integer& x : at) exact.push_back(as_fraction(x));
    norm = fixed_root_up(*inverse_form(map.P, exact));
    most = norm + off;
  }
  Column(const Map& map, const RangeRow& column) {
    std::vector<Integer> middle;
    Integer unknown;
    for (std::size_t i = 0; i < map.n; ++i) {
      middle.push_back(column[i].middle());
      unknown += times_up(column[i].hi - column[i].lo + 1, map.coordinate[i]);
    }
    *this = Column(map, std::move(middle), std::move(unknown));
  }
  /// At least |offset - r c| for the true row r and column c.
  Integer above(const Backwards& row, const Integer& offset) const {
    Integer sum = offset << kBits;
    for (std::size_t i = 0; i < at.size(); ++i) sum -= at[i] * row.state[i];
    return (abs(sum) >> kBits) + 2 + times_up(norm, row.error) + times_up(off, row.size);
  }
};

/// x = (I - M)^-1 b: r x is the sum of r b over this period and all before. What the residual of a computed x leaves is
/// summed up by the contraction.
Column summed(const Map& map, const RangeRow& b) {
  const std::size_t n = map.n;
  Square left(n, Row(n + 1));
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) left[i][j] = (i == j ? 1 : 0) - as_fraction(map.middle[i * n + j]);
    left[i][n] = as_fraction(b[i].middle());
  }
  for (std::size_t k = 0; k < n; ++k) {
    std::size_t pivot = k;
    while (pivot < n && sgn(left[pivot][k]) == 0) ++pivot;
    demand(pivot < n, "the loop has no limit under a constant input");
    std::swap(left[k], left[pivot]);
    for (std::size_t i = 0; i < n; ++i) {
      if (i == k || sgn(left[i][k]) == 0) continue;
      const Rational factor = left[i][k] / left[k][k];
      for (std::size_t j = k; j <= n; ++j) left[i][j] -= factor * left[k][j];
    }
  }
  std::vector<Integer> x;
  for (std::size_t i = 0; i < n; ++i) x.push_back(floor_fixed(left[i][n] / left[i][i]));
  Integer wrong;
  for (std::size_t i = 0; i < n; ++i) {
    Range residual = b[i];
    for (std::size_t j = 0; j < n; ++j) residual.add_product(map.M[i][j], Range(x[j]));
    residual.add(Range(Integer(-x[i])));
    wrong += times_up(residual.magnitude(), map.coordinate[i]);
  }
  return {map, std::move(x), ceil_fixed(as_fraction(wrong) / map.gap)};
}

/// Gains of one output to one input, in fixed point until `bounds`.
class Sums {
 public:
  /// @param own what the input of the output's own period adds; @param limit what a constant input leaves.
  Sums(const Map& map, const Rational& period_s, const RangeRow& effect, const Rational& own,
       const Rational& limit)
      : period_(period_s),
        limit_(limit),
        limit_fixed_(floor_fixed(limit)),
        effect_(map, effect),
        rest_(summed(map, effect)),
        own_(ceil_fixed(abs(own))) {
    highest_ = highest_effect_ = own_;
  }
  void add(const Backwards& row) {
    const Integer effect = effect_.above(row, 0), left = rest_.above(row, limit_fixed_);
    effects_ += effect, lefts_ += left;
    highest_effect_ = std::max(highest_effect_, effect);
    highest_ = std::max(highest_, left);
  }
  GainBounds bounds(const Backwards& end, const Rational& gap) const {
    const Rational size = as_fraction(end.size), tail = size / gap;
    GainBounds gains;
    if (sgn(limit_) == 0) gains.rate = period_ * (as_fraction(lefts_) + as_fraction(rest_.most) * tail);
    gains.amplitude = as_fraction(own_ + effects_) + as_fraction(effect_.most) * tail;
    gains.edge = std::max<Rational>(as_fraction(highest_), abs(limit_) + as_fraction(rest_.most) * size);
    gains.impulse =
        std::max<Rational>(as_fraction(highest_effect_), as_fraction(effect_.most) * size) / period_;
    return gains;
  }

 private:
  Rational period_, limit_;
  Integer limit_fixed_;
  Column effect_, rest_;
  Integer own_, effects_, lefts_, highest_, highest_effect_;
};

/// The same for a force, which acts at all times: k(u) = r_2 + r_1 u on each period.
class ForceSums {
 public:
  ForceSums(const Map& map, const Rational& period_s, const Rational& limit)
      : period_(period_s),
        limit_(limit),
        limit_fixed_(floor_fixed(limit)),
        position_(map, column(map, 1, 0)),
        late_(map, column(map, 0, 1)),
        early_(map, column(map, period_s, 1)),
        rest_(summed(map, column(map, period_s * period_s / 2, period_s))) {}

  void begin(const Backwards& row) { left_ = rest_.above(row, limit_fixed_); }
  /// Of the period before the row; add() then has the row one period before.
  void prepare(const Backwards& row) {
    const Integer late = late_.above(row, 0), early = early_.above(row, 0);
    ends_ += late + early;
    highest_effect_ = std::max({highest_effect_, late, early});
    bend_ = position_.above(row, 0);
    bends_ += bend_;
  }
  void add(const Backwards& row) {
    const Integer left = rest_.above(row, limit_fixed_);
    lefts_ += left_ + left;
    highest_ = std::max<Rational>(
        highest_, as_fraction(std::max(left_, left)) + period_ * period_ / 8 * as_fraction(bend_));
    left_ = left;
  }
  GainBounds bounds(const Backwards& end, const Rational& gap) const {
    const Rational size = as_fraction(end.size), tail = size / gap, bent = period_ * period_ * period_ / 12;
    const Rational effect = as_fraction(std::max(late_.most, early_.most));
    const Rational bend = as_fraction(position_.most);
    GainBounds gains;
    if (sgn(limit_) == 0) {
      gains.rate = period_ / 2 * as_fraction(lefts_) + bent * as_fraction(bends_) +
                   (period_ * as_fraction(rest_.most) + bent * bend) * tail;
    }
    gains.amplitude = period_ / 2 * as_fraction(ends_) + period_ * effect * tail;
    gains.edge = std::max<Rational>(
        highest_, abs(limit_) + (as_fraction(rest_.most) + period_ * period_ / 8 * bend) * size);
    gains.impulse = std::max<Rational>(as_fraction(highest_effect_), effect * size);
    return gains;
  }

 private:
  /// What a position and a speed at the end of a period come to.
  static RangeRow column(const Map& map, const Rational& position, const Rational& speed) {
    RangeRow result(map.n);
    result[0] = Range(position), result[1] = Range(speed);
    return result;
  }
  Rational period_, limit_;
  Integer limit_fixed_;
  Column position_, late_, early_, rest_;
  Integer left_, bend_, ends_, lefts_, bends_, highest_effect_;
  Rational highest_;
};

constexpr std::size_t kForce = 0, kInputs = 4;  // force, command, velocity, position
using AllGains = std::array<GainBounds, kInputs>;

/// Of one output, a row over the state before a control; `own`: what the inputs of that control add to it.
AllGains gains_of(const SampledWitness& loop, const Map& map, const Row& output,
                  const std::array<RangeRow, kInputs>& effects, const Row& own, const Row& limits) {
  const Rational period = loop.period_s;
  ForceSums force(map, period, limits[kForce]);
  std::vector<Sums> others;
  for (std::size_t i = 1; i < kInputs; ++i) others.emplace_back(map, period, effects[i], own[i], limits[i]);
  Backwards row(map, output);
  force.begin(row);
  for (long k = 0; k < loop.steps; ++k) {
    for (Sums& sums : others) sums.add(row);
    force.prepare(row);
    row.advance();
    force.add(row);
  }
  AllGains gains;
  gains[kForce] = force.bounds(row, map.gap);
  for (std::size_t i = 1; i < kInputs; ++i) gains[i] = others[i - 1].bounds(row, map.gap);
  return gains;
}

/// Adds what lies between the sampling times. In units of the acceleration that the input is.
void include_times_between(const SampledWitness& loop, const AllGains& command, AllGains& error) {
  const Rational period = loop.period_s, bend = period * period / 8;
  Rational age = Rational(loop.delay_s) + period;
  for (const double tau : loop.lags_s) age += Rational(tau);
  for (std::size_t i = 0; i < kInputs; ++i) {
    const bool is_force = i == kForce;
    const Rational amplitude = command[i].amplitude + (is_force ? 1 : 0);
    if (error[i].rate) *error[i].rate += bend * (*command[i].rate + (is_force ? age : Rational(0)));
    error[i].amplitude += bend * amplitude;
    error[i].edge += bend * amplitude;  // an input of variation 1 from zero stays below 1
    error[i].impulse += bend * command[i].impulse;
  }
  // An impulse since the last sampling time has changed the speed by its size, and no command yet.
  error[kForce].impulse = std::max(error[kForce].impulse, period);
}

GainBounds per_newton(GainBounds gains, double mass_kg) {
  const Rational mass = mass_kg;
  if (gains.rate) *gains.rate /= mass;
  gains.amplitude /= mass, gains.edge /= mass, gains.impulse /= mass;
  return gains;
}

}  // namespace

std::size_t order(const SampledWitness& loop) { return Layout(loop).size(); }

std::vector<std::vector<double>> period_map(const SampledWitness& loop) {
  check_numbers(loop);
  const Layout at(loop);
  std::vector<std::vector<double>> result;
  for (const RangeRow& row : product(hold_of(loop, at), enclosed(control_of(loop, at)))) {
    result.emplace_back();
    for (const Range& x : row) result.back().push_back(as_fraction(x.middle()).get_d());
  }
  return result;
}

SampledGainBounds sampled_upper_gains(const SampledWitness& loop) {
  check_numbers(loop);
  check_witness(loop);
  const Layout at(loop);
  const Ranges hold = hold_of(loop, at);
  const Square control = control_of(loop, at);
  const Map map(loop, at, hold, control);

  // What each input adds to the state after control.
  std::array<Row, kInputs> inputs;
  inputs.fill(Row(at.size() + 1));
  inputs[1][at.command] = 1;
  for (std::size_t i = 0; i <= at.size(); ++i) {
    inputs[2][i] = control[i][1] - (i == 1 ? 1 : 0);
    inputs[3][i] = control[i][0] - (i == 0 ? 1 : 0);
  }
  std::array<RangeRow, kInputs> effects;
  Row nothing(kInputs), own(kInputs);
  for (std::size_t k = 1; k < kInputs; ++k) {
    effects[k].resize(at.size());
    for (std::size_t i = 0; i < at.size(); ++i) {
      for (std::size_t j = 0; j <= at.size(); ++j) effects[k][i].add_product(hold[i][j], Range(inputs[k][j]));
    }
    own[k] = inputs[k][at.command];
  }
  Row error(at.size()), limits(kInputs);
  error[0] = 1;
  if (loop.Ki == 0) {
    limits[0] = limits[1] = 1 / Rational(loop.Kp);
    limits[2] = -Rational(loop.Kd) / Rational(loop.Kp);
  }
  limits[3] = -1;  // a wrong position is followed
  AllGains gains = gains_of(loop, map, error, effects, nothing, limits);
  // In the end every command, with the force, comes to nothing.
  include_times_between(loop, gains_of(loop, map, control[at.command], effects, own, nothing), gains);
  return {per_newton(gains[0], loop.mass_kg), per_newton(gains[1], loop.mass_kg), gains[2], gains[3]};
}

}  // namespace swarmcert::check
