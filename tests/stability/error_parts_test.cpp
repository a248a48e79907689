// All disturbances that a user can declare, acting together: no simulated error exceeds the reported bound.
#include "stability/bounds/error_parts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "stability/bounds/sampled_bounds.h"
#include "stability/bounds/tracking_bounds.h"
#include "stability/vehicle.h"
#include "stepped_loop.h"

namespace swarmcert::stability {
namespace {

using tests::kMass_kg;

constexpr double kStep_s = 0.0025;
constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// The loops under test: with and without integrator, lags and delay; continuous if `steps` is 0.
struct Case {
  const char* name;
  AxisLoop loop;
  int steps;  ///< number of kStep_s per period
  double integrator_share = 1;

  SampledLoop sampled() const {
    const double period_s = steps * kStep_s;
    return {loop, period_s, integrator_share * period_s};
  }
  SteppedLoop stepped() const {
    return steps == 0 ? SteppedLoop(loop, kStep_s) : SteppedLoop(sampled(), steps);
  }
};

std::vector<Case> cases() {
  return {{"continuous", {kMass_kg, 10, 5, 10, {1 / 17.4}, 0}, 0},
          {"continuous, two lags", {kMass_kg, 20, 10, 12, {1 / 17.4, 0.03}, 0}, 0},
          {"continuous, no integrator", {kMass_kg, 30, 9, 0, {1 / 17.4}, 0}, 0},
          {"continuous, late", {kMass_kg, 10, 5, 10, {1 / 17.4}, 0.015}, 0},
          {"sampled, late", {kMass_kg, 10, 5, 10, {1 / 17.4}, 0.015}, 4},
          {"sampled, no integrator", {kMass_kg, 30, 9, 0, {1 / 17.4}, 0}, 4},
          {"sampled, weak integrator", {kMass_kg, 10, 5, 10, {1 / 17.4}, 0}, 4, 0.2},
          {"sampled at 400 Hz", {kMass_kg, 20, 10, 12, {1 / 17.4, 0.03}, 0}, 1}};
}

/// Returns e at the end of every step, after `start` and under the forces that `force_of` returns.
std::vector<double> response(SteppedLoop loop, int count, const std::function<void(SteppedLoop&)>& start,
                             const std::function<double(SteppedLoop&, int)>& force_of) {
  std::vector<double> e;
  loop.reset();
  start(loop);
  for (int i = 0; i < count; ++i) {
    const double force_N = force_of(loop, i);
    e.push_back(loop.step(force_N, force_N));
  }
  return e;
}

/// Declarations for one axis, with inputs of the largest declared magnitude.
struct Declared {
  Disturbance known;
  OtherErrors other;
};

/// Returns the loop whose `axis` is that of the case.
FlownLoop flown(const Case& c, int axis, double limit_m_s) {
  const AxisLoop& one = c.loop;
  Gains gains;
  gains.pid = PidGains{{one.Kp, one.Kp, one.Kp}, {one.Kd, one.Kd, one.Kd}, {one.Ki, one.Ki, one.Ki}};
  gains.integrator_limit_m_s = {limit_m_s, limit_m_s, limit_m_s};
  if (c.steps > 0) {
    const SampledLoop sampled = c.sampled();
    gains.rate_hz = 1 / sampled.period_s;
    gains.integrator_step_s = sampled.integrator_step_s;
  }
  if (!one.lags_s.empty()) gains.motor_lag_s = one.lags_s[0];
  if (one.lags_s.size() > 1) gains.attitude_lag_s = one.lags_s[1];
  gains.delay_s = one.delay_s;
  FlownLoop loop = {gains, {one.mass_kg}};
  EXPECT_EQ(loop.continuous(axis)->lags_s, one.lags_s);
  return loop;
}

/// Only the vertical axis hovers, and only the horizontal ones have the second lag.
bool may_hover(const Case& c) { return c.loop.lags_s.size() < 2; }
double hover_N(const Case& c) { return may_hover(c) ? c.loop.mass_kg * kGravity_m_s2 : 0; }

AxisBounds bounds_of(const Case& c, const Declared& declared, double limit_m_s = kInfinite) {
  const int axis = may_hover(c) ? 2 : 0;
  const FlownLoop loop = flown(c, axis, limit_m_s);
  const OtherErrors& other = declared.other;
  DisturbanceSource source;
  source.kind = "declared";
  source.axis[axis] = declared.known;
  source.bias_N[axis] = other.bias_N;
  source.velocity_error[axis] = other.velocity_error;
  source.position_error[axis] = other.position_error;
  source.thrust_ratio_error = other.thrust_ratio_error;
  const InitialError initial = {other.position_m, other.velocity_m_s, other.start_N};
  EXPECT_TRUE(source.other(axis, initial, loop.plant) == other) << "a declaration was lost";
  return axis_bounds(loop, flown_gains(loop, axis, Channel::kForce), source, initial);
}

/// Signs with which all parts add up at the end of the run: those of the responses to each of them, backwards in time.
struct Worst {
  std::vector<double> force, velocity, position;
  double bias = 0, initial_position = 0, initial_velocity = 0;
};

Worst worst_of(const Case& c, int count) {
  const auto nothing = [](SteppedLoop&) {};
  const auto no_force = [](SteppedLoop&, int) { return 0.0; };
  const auto errs_at_first = [](double velocity, double position, int steps) {
    return [=](SteppedLoop& loop, int i) {
      loop.err_estimates(i < steps ? velocity : 0, i < steps ? position : 0);
      return 0.0;
    };
  };
  const int period = std::max(c.steps, 1);
  const SteppedLoop loop = c.stepped();
  Worst worst;
  worst.force = response(loop, count, nothing, [](SteppedLoop&, int i) { return i == 0 ? 1.0 : 0.0; });
  worst.velocity = response(loop, count, nothing, errs_at_first(1, 0, period));
  worst.position = response(loop, count, nothing, errs_at_first(0, 1, period));
  worst.bias = response(loop, count, nothing, [](SteppedLoop&, int) { return 1.0; }).back();
  worst.initial_position = response(
                               loop, count, [](SteppedLoop& l) { l.place(1, 0); }, no_force)
                               .back();
  worst.initial_velocity = response(
                               loop, count, [](SteppedLoop& l) { l.place(0, 1); }, no_force)
                               .back();
  return worst;
}

double sign(double x) { return x < 0 ? -1 : 1; }

/// Returns the largest |e| with every part at its declared maximum; a fraction `mistakes` of all signs is wrong.
double largest_error(const Case& c, const Declared& declared, const Worst& worst, double mistakes,
                     std::mt19937& random, double limit_m_s = kInfinite) {
  std::uniform_real_distribution<double> unit(0, 1);
  const auto turned = [&](double x) { return unit(random) < mistakes ? -sign(x) : sign(x); };
  const int count = static_cast<int>(worst.force.size());
  const auto back = [&](const std::vector<double>& kernel, int i) {
    return kernel[static_cast<std::size_t>(count - 1 - i)];
  };
  SteppedLoop loop = c.stepped();
  loop.reset();
  if (c.steps > 0) loop.clamp_integral(limit_m_s);
  const OtherErrors& other = declared.other;
  loop.place(other.position_m * turned(worst.initial_position),
             other.velocity_m_s * turned(worst.initial_velocity));
  const double bias_N = other.step_N() * turned(worst.bias);
  const Disturbance& known = declared.known;
  double most = std::abs(other.position_m), force_N = 0;
  double impulse_left = known.impulse_N_s;
  for (int i = 0; i < count; ++i) {
    if (i % std::max(c.steps, 1) == 0) {
      loop.err_estimates(other.velocity_error.amplitude * turned(back(worst.velocity, i)),
                         other.position_error.amplitude * turned(back(worst.position, i)));
    }
    double to_N = known.amplitude_N * turned(back(worst.force, i));
    if (std::isinf(known.amplitude_N)) to_N = 0;
    if (std::isfinite(known.rate_N_s)) {
      to_N = force_N + known.rate_N_s * kStep_s * turned(back(worst.force, i));
      if (std::isfinite(known.amplitude_N)) to_N = std::clamp(to_N, -known.amplitude_N, known.amplitude_N);
    } else {
      force_N = to_N;
    }
    if (std::isfinite(known.variation_N)) to_N = force_N = known.variation_N * sign(worst.bias);
    if (std::isfinite(known.impulse_N_s)) {
      // Spread over a tenth of a second around the largest response.
      const auto peak = std::max_element(worst.force.begin(), worst.force.end(),
                                         [](double a, double b) { return std::abs(a) < std::abs(b); });
      const int at = count - 1 - static_cast<int>(peak - worst.force.begin());
      const double now = std::abs(i - at) <= 20 ? std::min(impulse_left, known.impulse_N_s / 41) : 0;
      impulse_left -= now;
      to_N = force_N = now / kStep_s * sign(*peak);
    }
    most = std::max(most, std::abs(loop.step(force_N + bias_N, to_N + bias_N)));
    force_N = to_N;
  }
  return most;
}

/// Draws declarations with one class of the force error at a time, and random magnitudes of all other parts.
std::vector<Declared> random_declarations(std::mt19937& random, bool has_integrator) {
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<Declared> all(has_integrator ? 5 : 3);
  all[0].known.amplitude_N = 0.1 * unit(random);
  all[1].known.variation_N = 0.1 * unit(random);
  all[2].known.impulse_N_s = 0.02 * unit(random);
  if (has_integrator) {
    all[3].known.rate_N_s = 0.3 * unit(random);
    all[4].known.rate_N_s = 0.3 * unit(random);
    all[4].known.amplitude_N = 0.1 * unit(random);
  }
  for (Declared& declared : all) {
    const auto some = [&](double most) { return unit(random) < 0.3 ? 0 : most * unit(random); };
    declared.other = {some(0.15), some(0.2), some(0.1), some(0.5), {some(0.15)}, {some(0.02)}};
    if (unit(random) < 0.5) declared.other.bias_N = -declared.other.bias_N;
  }
  return all;
}

/// Error bound of the stepped loop: a delayed command of a continuous loop is stepped as if it were linear on each
/// step.
double stepping_error(const Case& c) { return c.steps == 0 && c.loop.delay_s > 0 ? 2e-5 : 1e-7; }

/// @param draws number per loop and per end of a run.
void check_everything(int draws, const std::vector<double>& ends_s) {
  std::mt19937 random(3);
  int runs = 0;
  for (const Case& c : cases()) {
    SCOPED_TRACE(c.name);
    double closest = 0;
    for (const double end_s : ends_s) {
      const Worst worst = worst_of(c, static_cast<int>(end_s / kStep_s));
      for (int k = 0; k < draws; ++k) {
        for (const Declared& declared : random_declarations(random, c.loop.Ki > 0)) {
          const AxisBounds bounds = bounds_of(c, declared);
          const double mistakes = k % 3 == 1 ? 0.1 : 0;
          const double ratio = largest_error(c, declared, worst, mistakes, random) / bounds.least();
          ++runs;
          closest = std::max(closest, ratio);
          ASSERT_LE(ratio, 1 + stepping_error(c))
              << "bias " << declared.other.bias_N << ", by " << bounds.bounds.which();
        }
      }
    }
    EXPECT_GT(closest, 0.75) << "the inputs did not try hard";
  }
  EXPECT_GE(runs, 34 * draws * static_cast<int>(ends_s.size()));
}

TEST(ErrorParts, EverythingDeclaredTogetherStaysBelowTheBound) { check_everything(2, {0.4, 1.2, 4}); }

TEST(ErrorParts, EverythingDeclaredTogetherStaysBelowTheBound_slow) {
  check_everything(40, {0.15, 0.3, 0.6, 1.2, 2.5, 6});
}

/// The actual vehicle if every thrust is (1 + d) times that of the model.
Case with_ratio(Case c, double d) {
  for (double* const gain : {&c.loop.Kp, &c.loop.Kd, &c.loop.Ki}) *gain *= 1 + d;
  return c;
}
Declared with_hover_force(Declared declared, double d) {
  const double force_N = std::abs(d) * declared.other.hover_N;
  declared.other.bias_N = declared.other.step_N() + force_N;
  return declared;
}

/// Checks the largest |e| over ratios within the error, relative to the bound that knows only the error.
void check_ratios(double limit_m_s, double least_closest) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (const Case& c : cases()) {
    if (std::isfinite(limit_m_s) && (c.steps == 0 || c.loop.Ki == 0)) continue;
    SCOPED_TRACE(c.name);
    double closest = 0;
    int clamped = 0;
    for (const double error : {0.02, 0.15}) {
      for (Declared declared : random_declarations(random, c.loop.Ki > 0)) {
        declared.other.thrust_ratio_error = error;
        declared.other.hover_N = hover_N(c);
        const AxisBounds bounds = bounds_of(c, declared, limit_m_s);
        clamped += !bounds.clamp.never_acts;
        if (!std::isfinite(bounds.least())) continue;
        for (const double d : {-error, error, unit(random) * error}) {
          const Case flown = with_ratio(c, d);
          for (const double end_s : {0.4, 1.5, 5.0}) {
            const Worst worst = worst_of(flown, static_cast<int>(end_s / kStep_s));
            const double ratio =
                largest_error(flown, with_hover_force(declared, d), worst, 0, random, limit_m_s) /
                bounds.least();
            closest = std::max(closest, ratio);
            ASSERT_LE(ratio, 1 + stepping_error(c)) << "d " << d << " of " << error;
          }
        }
      }
    }
    EXPECT_GT(closest, least_closest) << "the inputs did not try hard";
    EXPECT_TRUE(clamped > 0 || std::isinf(limit_m_s));
  }
}

TEST(ErrorParts, NoThrustRatioWithinItsErrorLeavesTheBound) { check_ratios(kInfinite, 0.7); }

TEST(ErrorParts, NoThrustRatioWithinItsErrorLeavesTheBoundWithAnActingClamp) { check_ratios(0.02, 0.5); }

TEST(ErrorParts, AnErrorOfTheThrustRatioCostsASagThatIsKnownWithoutIntegrator) {
  // m e'' = -(1 + d) m (Kp e + Kd e') + d m g rests at e = d g / ((1 + d) Kp).
  const double error = 0.1, Kp = 30;
  const Case c = {"no integrator, no lag", {kMass_kg, Kp, 12, 0, {}, 0}, 0};
  Declared declared;
  declared.known.amplitude_N = 0;
  declared.other.thrust_ratio_error = error;
  declared.other.hover_N = hover_N(c);
  const double sag_m = error * kGravity_m_s2 / ((1 - error) * Kp);
  const double bound_m = bounds_of(c, declared).least();
  EXPECT_GE(bound_m, sag_m);
  EXPECT_LE(bound_m, 1.1 * sag_m);
  // If an error of the ratio could reverse the sign of the feedback, small gain gives no bound.
  declared.other.thrust_ratio_error = 0.89;
  EXPECT_TRUE(std::isinf(bounds_of(c, declared).parts.thrust_ratio_m));
}

TEST(ErrorParts, EachPartAloneIsReached) {
  std::mt19937 random(1);
  const std::pair<const char*, OtherErrors> parts[] = {
      {"bias", {-0.1}},
      {"start", {0, 0.1}},
      {"position", {0, 0, 0.1}},
      {"velocity", {0, 0, 0, 0.4}},
      {"velocity error", {0, 0, 0, 0, EstimateError{0.1}}},
      {"position error", {0, 0, 0, 0, {}, EstimateError{0.02}}}};
  for (const Case& c : cases()) {
    for (const auto& [name, other] : parts) {
      SCOPED_TRACE(std::string(c.name) + ": " + name);
      Declared declared;
      declared.known.amplitude_N = 0;
      declared.other = other;
      const double bound = bounds_of(c, declared).least();
      double most = 0;
      for (double end_s = 0.1; end_s < 18; end_s *= 1.4) {
        const Worst worst = worst_of(c, static_cast<int>(end_s / kStep_s));
        most = std::max(most, largest_error(c, declared, worst, 0, random));
      }
      EXPECT_LE(most, bound * (1 + stepping_error(c)));
      // Velocity jumps between samples are worse, and slow loops take longer than the runs.
      EXPECT_GT(most, 0.88 * bound);
    }
  }
}

/// Returns e at the end of a run after a unit error of one estimate during one period, indexed by that period.
std::vector<double> estimate_kernel(const Case& c, Estimate estimate, int periods) {
  const int steps = std::max(c.steps, 1);
  std::vector<double> kernel;
  const std::vector<double> e = response(
      c.stepped(), periods * steps, [](SteppedLoop&) {},
      [&](SteppedLoop& loop, int i) {
        const double n = i < steps ? 1 : 0;
        loop.err_estimates(estimate == Estimate::kVelocity ? n : 0, estimate == Estimate::kPosition ? n : 0);
        return 0.0;
      });
  for (int k = 0; k < periods; ++k) kernel.push_back(e[static_cast<std::size_t>((periods - k) * steps - 1)]);
  return kernel;
}

/// Returns the worst error of an estimate within a finite amplitude and a finite rate: a backward dynamic program over
/// multiples of the change that the rate allows per period. The only loss is rounding the amplitude down to such a
/// multiple, since a linear program of differences has an integer solution.
std::vector<double> worst_within(const EstimateError& known, const std::vector<double>& kernel,
                                 double period_s) {
  const double unit = known.rate * period_s;
  const int most = static_cast<int>(known.amplitude / unit), levels = 2 * most + 1;
  std::vector<double> value(static_cast<std::size_t>(levels), 0.0), next(value);
  std::vector<std::vector<signed char>> moves(kernel.size(),
                                              std::vector<signed char>(static_cast<std::size_t>(levels)));
  for (std::size_t k = kernel.size(); k-- > 0;) {
    next.swap(value);
    for (int i = 0; i < levels; ++i) next[static_cast<std::size_t>(i)] += kernel[k] * (i - most);
    for (int i = 0; i < levels; ++i) {
      int best = i;
      for (const int to : {i - 1, i + 1}) {
        if (to >= 0 && to < levels &&
            next[static_cast<std::size_t>(to)] > next[static_cast<std::size_t>(best)])
          best = to;
      }
      value[static_cast<std::size_t>(i)] = next[static_cast<std::size_t>(best)];
      moves[k][static_cast<std::size_t>(i)] = static_cast<signed char>(best - i);
    }
  }
  std::vector<double> n;
  int at = most;
  for (const std::vector<signed char>& move : moves) {
    at += move[static_cast<std::size_t>(at)];
    n.push_back((at - most) * unit);
  }
  return n;
}

/// Returns the worst error of an estimate in its class for the error at the end of the run, one number per period.
std::vector<double> worst_error(const EstimateError& known, const std::vector<double>& kernel,
                                double period_s) {
  if (std::isfinite(known.amplitude) && std::isfinite(known.rate))
    return worst_within(known, kernel, period_s);
  std::vector<double> n(kernel.size(), 0.0);
  std::vector<double> after = kernel;  // the response to a step that begins in a period
  for (std::size_t k = kernel.size() - 1; k-- > 0;) after[k] += after[k + 1];
  const auto largest = [](const std::vector<double>& values) {
    return static_cast<std::size_t>(
        std::max_element(values.begin(), values.end(),
                         [](double a, double b) { return std::abs(a) < std::abs(b); }) -
        values.begin());
  };
  if (std::isfinite(known.impulse)) {
    n[largest(kernel)] = known.impulse / period_s;
  } else if (std::isfinite(known.variation)) {
    std::fill(n.begin() + static_cast<std::ptrdiff_t>(largest(after)), n.end(), known.variation);
  } else {
    double now = 0;
    for (std::size_t k = 0; k < n.size(); ++k) {
      now += known.rate * period_s * sign(after[k]);
      n[k] = now = std::clamp(now, -known.amplitude, known.amplitude);
    }
  }
  return n;
}

TEST(ErrorParts, NoErrorOfAnEstimateInItsClassExceedsItsBoundAndTheWorstComesNear) {
  struct Class {
    const char* name;
    EstimateError velocity, position;
    double near;  ///< fraction of the bound
  };
  const Class classes[] = {
      {"rate", {kInfinite, 0.3}, {}, 0.97},
      {"amplitude and rate", {0.1, 0.3}, {}, 0.98},
      {"amplitude and rate", {}, {0.02, 0.005}, 0.9},
      {"variation", {kInfinite, kInfinite, 0.2}, {kInfinite, kInfinite, 0.02}, 0.99},
      {"impulse", {kInfinite, kInfinite, kInfinite, 0.01}, {kInfinite, kInfinite, kInfinite, 0.004}, 0.95}};
  int judged = 0;
  for (const Case& c : cases()) {
    for (const Class& of : classes) {
      for (const Estimate estimate : {Estimate::kVelocity, Estimate::kPosition}) {
        const bool is_velocity = estimate == Estimate::kVelocity;
        const EstimateError& known = is_velocity ? of.velocity : of.position;
        // Without an integrator a drift of the velocity estimate has no bound, and a drift of the position estimate
        // never has one.
        if (known.is_zero() || (c.loop.Ki == 0 && std::isfinite(known.rate))) continue;
        SCOPED_TRACE(std::string(c.name) + ": " + of.name + (is_velocity ? " of v" : " of p"));
        Declared declared;
        declared.known.amplitude_N = 0;
        (is_velocity ? declared.other.velocity_error : declared.other.position_error) = known;
        const double bound = bounds_of(c, declared).least();
        const int steps = std::max(c.steps, 1);
        const double period_s = steps * kStep_s;
        double most = 0;
        for (const double end_s : {0.3, 0.6, 1.2, 4.0, 30.0}) {
          const std::vector<double> n =
              worst_error(known, estimate_kernel(c, estimate, static_cast<int>(end_s / period_s)), period_s);
          for (const double e : response(
                   c.stepped(), static_cast<int>(n.size()) * steps, [](SteppedLoop&) {},
                   [&](SteppedLoop&loop, int i) {
                     const double now = n[static_cast<std::size_t>(i / steps)];
                     loop.err_estimates(is_velocity ? now : 0, is_velocity ? 0 : now);
                     return 0.0;
                   })) {
            most = std::max(most, std::abs(e));
          }
        }
        // A continuous loop sees n as a staircase, which is up to one step ahead of its class.
        const double ahead = c.steps == 0 && std::isfinite(known.rate)
                                 ? known.rate * kStep_s * continuous_norms(c.loop, estimate).amplitude
                                 : 0;
        EXPECT_LE(most, bound * (1 + (c.steps == 0 && c.loop.delay_s > 0 ? 2e-5 : 1e-7)) + ahead);
        EXPECT_GT(most, of.near * bound);
        ++judged;
      }
    }
  }
  EXPECT_GE(judged, 50);
}

TEST(ErrorParts, AnActingClampOfTheIntegratorIsCounted) {
  std::mt19937 random(7);
  const Case c = {"sampled", {kMass_kg, 10, 5, 10, {1 / 17.4}, 0}, 4};
  int acted = 0, never = 0;
  double closest = 0;
  for (const double limit_m_s : {0.02, 0.1, 0.4, 2.0}) {
    for (const double end_s : {0.6, 1.5}) {
      const Worst worst = worst_of(c, static_cast<int>(end_s / kStep_s));
      for (int k = 0; k < 8; ++k) {
        Declared declared = random_declarations(random, true)[k % 2 == 0 ? 0 : 2];
        const AxisBounds bounds = bounds_of(c, declared, limit_m_s);
        (bounds.clamp.never_acts ? never : acted) += 1;
        const double error_m = largest_error(c, declared, worst, 0, random, limit_m_s);
        ASSERT_LE(error_m, bounds.least() * (1 + 1e-7)) << limit_m_s;
        closest = std::max(closest, error_m / bounds.least());
      }
    }
  }
  EXPECT_GT(acted, 8);
  EXPECT_GT(never, 8);
  EXPECT_GT(closest, 0.7);
}

TEST(ErrorParts, TheDemandOnTheIntegratorIsNotExceeded) {
  std::mt19937 random(9);
  for (const Case& c : cases()) {
    if (c.loop.Ki == 0) continue;
    SCOPED_TRACE(c.name);
    const double share = c.steps > 0 ? c.integrator_share : 1;
    double closest = 0;
    for (int k = 0; k < 15; ++k) {
      Declared declared = random_declarations(random, true)[0];
      declared.known.amplitude_N = 0;
      const double demand_m_s = c.steps > 0
                                    ? integral_demand_m_s(c.sampled(), Channel::kForce, declared.other)
                                    : integral_demand_m_s(c.loop, Channel::kForce, declared.other);
      SteppedLoop loop = c.stepped();
      loop.reset();
      loop.place(declared.other.position_m, declared.other.velocity_m_s);
      loop.err_estimates(-declared.other.velocity_error.amplitude, declared.other.position_error.amplitude);
      double most = 0;
      for (int i = 0; i < 3000; ++i) {
        loop.step(declared.other.step_N(), declared.other.step_N());
        most = std::max(most, std::abs(loop.integral_m_s()));
      }
      ASSERT_LE(most, demand_m_s * (1 + 1e-7)) << share;
      closest = std::max(closest, most / demand_m_s);
    }
    EXPECT_GT(closest, 0.6);
  }
}

}  // namespace
}  // namespace swarmcert::stability
