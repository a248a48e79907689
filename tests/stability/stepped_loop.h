/// @file One axis of the loop, stepped through time, as a reference for bounds and gains. Shares no code with them:
/// Runge-Kutta on the differential equations, no transfer function, no matrix exponential.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "stability/bounds/loops/sampled_loop.h"

namespace swarmcert::stability {

/// The force is linear on each step, with jumps between steps; so is the command of a continuous loop with a delay.
class SteppedLoop {
 public:
  /// Continuous loop. A delay must be a whole number of steps.
  SteppedLoop(const AxisLoop& loop, double step_s) : loop_(loop), step_s_(step_s) { prepare(); }
  /// Sampled loop: the control runs every `steps_per_period` steps.
  SteppedLoop(const SampledLoop& loop, int steps_per_period)
      : loop_(loop.plant),
        step_s_(loop.period_s / steps_per_period),
        integrator_step_s_(loop.integrator_step_s),
        steps_per_period_(steps_per_period) {
    prepare();
  }

  double step_s() const { return step_s_; }

  void reset() {
    x_.fill(0);
    past_.assign(past_.size(), 0.0);
    count_ = 0;
    command_ = 0;
    velocity_error_ = position_error_ = 0;
  }
  /// Sets the errors that the law adds to e' and e from the next step on, constant over each step.
  void err_estimates(double velocity_m_s, double position_m) {
    velocity_error_ = velocity_m_s;
    position_error_ = position_m;
  }
  /// Sets a clamp of the integrator's state; for a sampled loop.
  void clamp_integral(double limit_m_s) { limit_m_s_ = limit_m_s; }
  double integral_m_s() const { return x_[2]; }
  /// Sets position and velocity. An impulse of force is a change of the velocity.
  void place(double e_m, double speed_m_s) {
    x_[0] = e_m;
    x_[1] = speed_m_s;
  }

  /// Takes one step and returns e at its end; `command_error_N` is added to the command of the period that begins now.
  double step(double from_N, double to_N, double command_error_N = 0) {
    const double f0 = from_N / loop_.mass_kg;
    const double f1 = to_N / loop_.mass_kg;
    if (steps_per_period_ > 0) {
      if (count_ % steps_per_period_ == 0) {
        integral_() =
            std::clamp(integral_() + integrator_step_s_ * (x_[0] + position_error_), -limit_m_s_, limit_m_s_);
        command_ = feedback() + command_error_N / loop_.mass_kg;
      }
      push(command_);
      advance(f0, f1, delayed(0), delayed(0));
    } else if (past_.size() > 1) {
      push(feedback());
      // The command begins with a jump: it has no effect before its time.
      const bool begins_next = count_ + 2 == static_cast<long>(past_.size());
      advance(f0, f1, delayed(0), begins_next ? delayed(0) : delayed(1));
    } else {
      advance(f0, f1, 0, 0);
    }
    ++count_;
    return x_[0];
  }

 private:
  static constexpr std::size_t kMost = 8;
  using State = std::array<double, kMost>;  ///< e, e', int e, lag outputs from the last to the first

  double& integral_() { return x_[2]; }
  double feedback() const {
    return -(loop_.Kp * (x_[0] + position_error_) + loop_.Kd * (x_[1] + velocity_error_) + loop_.Ki * x_[2]);
  }

  void push(double command) { past_[static_cast<std::size_t>(count_) % past_.size()] = command; }
  /// Returns the command that acts now, or `later` steps later.
  double delayed(int later) const {
    const long k = count_ + later + 1;  // the slot after the newest is the oldest
    return past_[static_cast<std::size_t>(k) % past_.size()];
  }

  bool closes_itself() const { return steps_per_period_ == 0 && past_.size() == 1; }

  /// Inputs at one instant.
  struct Inputs {
    double force = 0, command = 0, velocity_error = 0, position_error = 0;
  };

  State rate(const State& x, const Inputs& in) const {
    State d{};
    double input = in.command;
    if (closes_itself()) {
      input =
          -(loop_.Kp * (x[0] + in.position_error) + loop_.Kd * (x[1] + in.velocity_error) + loop_.Ki * x[2]);
    }
    for (std::size_t i = lags_s_.size(); i-- > 0;) {
      d[3 + i] = (input - x[3 + i]) / lags_s_[i];
      input = x[3 + i];
    }
    d[0] = x[1];
    d[1] = input + in.force;
    d[2] = steps_per_period_ == 0 ? x[0] + in.position_error : 0;
    return d;
  }

  /// Force and command are linear on the step, errors of the estimates are constant.
  State runge_kutta(State x, const Inputs& from, const Inputs& to) const {
    constexpr int kParts = 16;
    const double dt = step_s_ / kParts;
    const auto moved = [&](const State& state, const State& d, double by) {
      State result = state;
      for (std::size_t i = 0; i < size_; ++i) result[i] += by * d[i];
      return result;
    };
    for (int p = 0; p < kParts; ++p) {
      const auto at = [&](double part) {
        const double share = (p + part) / kParts;
        Inputs in = from;
        in.force += (to.force - from.force) * share;
        in.command += (to.command - from.command) * share;
        return in;
      };
      const State a = rate(x, at(0));
      const State b = rate(moved(x, a, dt / 2), at(0.5));
      const State c = rate(moved(x, b, dt / 2), at(0.5));
      const State d = rate(moved(x, c, dt), at(1));
      for (std::size_t i = 0; i < size_; ++i) x[i] += dt / 6 * (a[i] + 2 * b[i] + 2 * c[i] + d[i]);
    }
    return x;
  }

  /// A step is linear in the state and its six inputs: one column for each, integrated once.
  void prepare() {
    for (const double tau : loop_.lags_s) {
      if (tau > 0) lags_s_.push_back(tau);
    }
    size_ = 3 + lags_s_.size();
    const auto whole = static_cast<std::size_t>(std::lround(loop_.delay_s / step_s_));
    past_.assign(whole + 1, 0.0);
    for (std::size_t i = 0; i < size_; ++i) {
      State unit{};
      unit[i] = 1;
      columns_[i] = runge_kutta(unit, {}, {});
    }
    const Inputs unit_inputs[] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};
    for (std::size_t i = 0; i < 2; ++i) {
      columns_[size_ + 2 * i] = runge_kutta({}, unit_inputs[i], {});
      columns_[size_ + 2 * i + 1] = runge_kutta({}, {}, unit_inputs[i]);
      columns_[size_ + 4 + i] = runge_kutta({}, unit_inputs[2 + i], unit_inputs[2 + i]);
    }
  }

  void advance(double f0, double f1, double u0, double u1) {
    const double inputs[kInputs] = {f0, f1, u0, u1, velocity_error_, position_error_};
    State next{};
    for (std::size_t j = 0; j < size_ + kInputs; ++j) {
      const double by = j < size_ ? x_[j] : inputs[j - size_];
      for (std::size_t i = 0; i < size_; ++i) next[i] += columns_[j][i] * by;
    }
    x_ = next;
  }

  AxisLoop loop_;
  double step_s_;
  double integrator_step_s_ = 0;
  int steps_per_period_ = 0;  ///< 0: continuous
  std::vector<double> lags_s_;
  std::size_t size_ = 0;
  static constexpr std::size_t kInputs = 6;
  std::array<State, kMost + kInputs> columns_{};
  State x_{};
  std::vector<double> past_;
  double command_ = 0;
  double velocity_error_ = 0, position_error_ = 0;
  double limit_m_s_ = std::numeric_limits<double>::infinity();
  long count_ = 0;
};

}  // namespace swarmcert::stability
