#include "stability/checker/sampled_gain_bounds.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "stability/checker/sampled_map.h"

namespace swarmcert::check {
namespace {

constexpr long kMostPeriods = 1 << 18;

void check_sampling(const SampledWitness& loop) {
  check_numbers(loop);
  demand(is_usual(loop.period_s) && is_usual(loop.integrator_step_s),
         "period_s or integrator_step_s is out of range");
}

void check_witness(const SampledWitness& loop) {
  check_sampling(loop);
  demand(loop.steps >= 1 && loop.steps <= kMostPeriods, "steps is out of range");
  demand(loop.contraction >= 0x1p-10 && loop.contraction <= 1 - 0x1p-40, "contraction is out of range");
}

/// A row that is propagated backwards, period by period.
class Backwards {
 public:
  Backwards(const PeriodMap& map, const Row& row) : map_(map), next_(map.n) {
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
  Integer error;    ///< upper bound on |true row - state|
  Integer largest;  ///< max |state_i|
  Integer size;     ///< upper bound on |true row|

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

  const PeriodMap& map_;
  std::vector<Integer> next_;
};

/// A column with which rows are multiplied.
struct Column {
  std::vector<Integer> at;
  Integer norm;  ///< |r at| <= norm |r|
  Integer off;   ///< the true column differs from `at` by at most this, in the same sense
  Integer most;  ///< norm + off

  Column() = default;
  Column(const PeriodMap& map, std::vector<Integer> middle, Integer unknown)
      : at(std::move(middle)), off(std::move(unknown)) {
    Row exact;
    for (const Integer& x : at) exact.push_back(as_fraction(x));
    norm = fixed_root_up(*inverse_form(map.P, exact));
    most = norm + off;
  }
  Column(const PeriodMap& map, const FixedRangeRow& column) {
    std::vector<Integer> middle;
    Integer unknown;
    for (std::size_t i = 0; i < map.n; ++i) {
      middle.push_back(column[i].middle());
      unknown += times_up(column[i].upper - column[i].lower + 1, map.coordinate[i]);
    }
    *this = Column(map, std::move(middle), std::move(unknown));
  }
  /// Returns an upper bound on |offset - r c| for the true row r and column c.
  Integer above(const Backwards& row, const Integer& offset) const {
    Integer sum = offset << kBits;
    for (std::size_t i = 0; i < at.size(); ++i) sum -= at[i] * row.state[i];
    return (abs(sum) >> kBits) + 2 + times_up(norm, row.error) + times_up(off, row.size);
  }
};

/// Computes x = (I - M)^-1 b: r x is the sum of r b over this period and all before. The residual of the computed x,
/// summed by the contraction, bounds its error.
Column summed(const PeriodMap& map, const FixedRangeRow& b) {
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
    FixedRange residual = b[i];
    for (std::size_t j = 0; j < n; ++j) residual.add_product(map.M[i][j], FixedRange(x[j]));
    residual.add(FixedRange(Integer(-x[i])));
    wrong += times_up(residual.magnitude(), map.coordinate[i]);
  }
  return {map, std::move(x), ceil_fixed(as_fraction(wrong) / map.gap)};
}

/// Gains of one output from one input, in fixed point until `bounds`.
class Sums {
 public:
  /// @param own contribution of the input in the output's own period; @param limit response to a constant input.
  Sums(const PeriodMap& map, const Rational& period_s, const FixedRangeRow& effect, const Rational& own,
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

/// The same for a force, which acts continuously: k(u) = r_2 + r_1 u on each period.
class ForceSums {
 public:
  ForceSums(const PeriodMap& map, const Rational& period_s, const Rational& limit)
      : period_(period_s),
        limit_(limit),
        limit_fixed_(floor_fixed(limit)),
        position_(map, column(map, 1, 0)),
        late_(map, column(map, 0, 1)),
        early_(map, column(map, period_s, 1)),
        rest_(summed(map, column(map, period_s * period_s / 2, period_s))) {}

  void begin(const Backwards& row) { left_ = rest_.above(row, limit_fixed_); }
  /// Handles the period before the row; add() then takes the row one period earlier.
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
  /// Returns the response to a position and a velocity at the end of a period.
  static FixedRangeRow column(const PeriodMap& map, const Rational& position, const Rational& speed) {
    FixedRangeRow result(map.n);
    result[0] = FixedRange(position), result[1] = FixedRange(speed);
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

/// Returns the gains of one output, a row over the state before a control; `own`: direct contribution of that control's
/// inputs.
AllGains gains_of(const SampledWitness& loop, const PeriodMap& map, const Row& output,
                  const std::array<FixedRangeRow, kInputs>& effects, const Row& own, const Row& limits) {
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

/// Adds the excess between the sampling times, in units of the input's acceleration.
void include_times_between(const SampledWitness& loop, const AllGains& command, AllGains& error) {
  const Rational period = loop.period_s, bend = period * period / 8;
  Rational age = Rational(loop.delay_s) + period;
  for (const double tau : loop.lags_s) age += Rational(tau);
  for (std::size_t i = 0; i < kInputs; ++i) {
    const bool is_force = i == kForce;
    const Rational amplitude = command[i].amplitude + (is_force ? 1 : 0);
    if (error[i].rate) *error[i].rate += bend * (*command[i].rate + (is_force ? age : Rational(0)));
    error[i].amplitude += bend * amplitude;
    error[i].edge += bend * amplitude;  // an input of total variation 1 from zero stays below 1
    error[i].impulse += bend * command[i].impulse;
  }
  // An impulse since the last sampling time has changed the velocity by its size, but no command yet.
  error[kForce].impulse = std::max(error[kForce].impulse, period);
}

GainBounds per_newton(GainBounds gains, double mass_kg) {
  const Rational mass = mass_kg;
  if (gains.rate) *gains.rate /= mass;
  gains.amplitude /= mass, gains.edge /= mass, gains.impulse /= mass;
  return gains;
}

}  // namespace

std::size_t order(const SampledWitness& loop) { return SampledLayout(loop).size(); }

std::vector<std::vector<double>> period_map(const SampledWitness& loop) {
  check_sampling(loop);
  const SampledLayout at(loop);
  std::vector<std::vector<double>> result;
  for (const FixedRangeRow& row : period_ranges(hold_of(loop, at), control_of(loop, at))) {
    result.emplace_back();
    for (const FixedRange& x : row) result.back().push_back(as_fraction(x.middle()).get_d());
  }
  return result;
}

SampledGainBounds sampled_upper_gains(const SampledWitness& loop) {
  check_witness(loop);
  const SampledLayout at(loop);
  const FixedRanges hold = hold_of(loop, at);
  const Square control = control_of(loop, at);
  const PeriodMap map(loop, period_ranges(hold, control));

  // Contributions of each input to the state after the control.
  std::array<Row, kInputs> inputs;
  inputs.fill(Row(at.size() + 1));
  inputs[1][at.command] = 1;
  for (std::size_t i = 0; i <= at.size(); ++i) {
    inputs[2][i] = control[i][1] - (i == 1 ? 1 : 0);
    inputs[3][i] = control[i][0] - (i == 0 ? 1 : 0);
  }
  std::array<FixedRangeRow, kInputs> effects;
  Row nothing(kInputs), own(kInputs);
  for (std::size_t k = 1; k < kInputs; ++k) {
    effects[k].resize(at.size());
    for (std::size_t i = 0; i < at.size(); ++i) {
      for (std::size_t j = 0; j <= at.size(); ++j)
        effects[k][i].add_product(hold[i][j], FixedRange(inputs[k][j]));
    }
    own[k] = inputs[k][at.command];
  }
  Row error(at.size()), limits(kInputs);
  error[0] = 1;
  if (loop.Ki == 0) {
    limits[0] = limits[1] = 1 / Rational(loop.Kp);
    limits[2] = -Rational(loop.Kd) / Rational(loop.Kp);
  }
  limits[3] = -1;  // the vehicle follows a wrong position
  AllGains gains = gains_of(loop, map, error, effects, nothing, limits);
  // In the long run, every command plus the force tends to zero.
  include_times_between(loop, gains_of(loop, map, control[at.command], effects, own, nothing), gains);
  return {per_newton(gains[0], loop.mass_kg), per_newton(gains[1], loop.mass_kg), gains[2], gains[3]};
}

}  // namespace swarmcert::check
