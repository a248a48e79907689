/// @file Flights of the loop assumed by tubes.
///
/// Decoupled axes, first-order lags, piecewise constant predictions; continuous, or with a command held over a period
/// of the gains' rate and the firmware's integrator.
#pragma once

#include <array>
#include <cmath>
#include <functional>
#include <optional>

#include "analysis/tracking/tube/error_loops.h"
#include "stability/bounds/loops/axis_loop.h"
#include "stability/bounds/loops/sampled_loop.h"
#include "stability/tasks/task.h"
#include "tube/forces.h"
#include "tube/scenes.h"

namespace swarmcert::tests {

/// Runge-Kutta with steps of a millisecond, of which the period of the loop must be a multiple. The prediction times of
/// each vehicle are random; predictions reach the controller late. Errors of the estimates switch between plus and
/// minus their bounds at random rates, independently, or are constant. If an interval is given, the motors of each
/// vehicle have a random lag in each flight. With a single lag, rotors start anywhere between the weight and the first
/// prediction. If a residual is given, it acts in addition to the truth.
class AxesFlight {
 public:
  /// Called with the time, the vehicle, e and e'.
  using Look = std::function<void(double, int, const std::array<double, 3>&, const std::array<double, 3>&)>;

  AxesFlight(const stability::FlownLoop& tracking, const stability::Model& truth,
             const files::Network& network, const stability::Task& task, int vehicles,
             bool is_sampled = false, const analysis::EstimateErrors& estimates = {},
             const std::optional<Interval>& motor_lag_s = {},
             const analysis::ResidualEnvelope* residual = nullptr)
      : residual_(residual),
        estimates_(estimates),
        motor_lag_s_(motor_lag_s),
        gains_(tracking.gains),
        task_(task),
        vehicles_(vehicles),
        is_sampled_(is_sampled),
        forces_(network, truth) {
    Loops loops;
    for (int k = 0; k < 3; ++k) {
      loops[k] = *tracking.continuous(k);
    }
    loops_.assign(static_cast<std::size_t>(vehicles), loops);
  }

  void fly(files::Random& random, const Look& look) {
    std::vector<Vehicle> now(static_cast<std::size_t>(vehicles_));
    draw_switching(random);
    draw_lags(random);
    const double period_s = gains_.network_rate_hz > 0 ? 1 / gains_.network_rate_hz : 0;
    std::vector<double> next_s, predicted, acting;
    for (int i = 0; i < vehicles_; ++i) {
      next_s.push_back(std::round(between(random, 0, period_s) / kStep_s) * kStep_s);
      predicted.push_back(forces_.learned(forces_.at(state(now, i, 0, true), vehicles_ - 1)));
    }
    acting = predicted;
    for (int i = 0; i < vehicles_; ++i) {
      const auto at = static_cast<std::size_t>(i);
      const double excess_N = -between(random, 0, 1) * predicted[at];
      if (has_one_lag(loops_[at][2])) now[at][2][3] = excess_N;
    }
    const int every = is_sampled_ ? static_cast<int>(std::lround(1 / (gains_.rate_hz * kStep_s))) : 0;
    std::vector<std::array<double, 3>> sums(now.size()), held(now.size());
    const int steps = static_cast<int>(std::lround(task_.duration_s() / kStep_s));
    for (int s = 0; s < steps; ++s) {
      const double t = s * kStep_s;
      for (int i = 0; i < vehicles_ && period_s > 0; ++i) {
        const auto at = static_cast<std::size_t>(i);
        if (t > next_s[at] - kStep_s / 2) {
          predicted[at] = forces_.learned(forces_.at(state(now, i, t, true), vehicles_ - 1));
          next_s[at] += period_s;
        }
        // The last prediction was made at next_s - period_s.
        if (t > next_s[at] - period_s + gains_.network_latency_s - kStep_s / 2) acting[at] = predicted[at];
      }
      for (int i = 0; i < vehicles_ && every > 0 && s % every == 0; ++i) {
        const auto at = static_cast<std::size_t>(i);
        const double learned =
            period_s > 0 ? acting[at] : forces_.learned(forces_.at(state(now, i, t, true), vehicles_ - 1));
        for (std::size_t k = 0; k < 3; ++k) {
          Axis sampled = estimated(now[at][k], i, k, t);
          sums[at][k] += every * kStep_s * sampled[0];
          sampled[2] = sums[at][k];
          held[at][k] = command(sampled, at, k, task_.at(i, t).a_W_m_s2, learned);
        }
      }
      const auto rate = [&](const std::vector<Vehicle>& x, double time_s) {
        std::vector<Vehicle> result(x.size());
        for (int i = 0; i < vehicles_; ++i) {
          const auto at = static_cast<std::size_t>(i);
          const std::vector<double> met = state(x, i, time_s);
          const Eigen::Vector3d force =
              forces_.truth(forces_.at(met, vehicles_ - 1)) + residual_at(met, i, time_s);
          const double learned = period_s > 0
                                     ? acting[at]
                                     : forces_.learned(forces_.at(state(x, i, time_s, true), vehicles_ - 1));
          result[at] = derivative(x[at], i, time_s, force, learned, every > 0 ? &held[at] : nullptr);
        }
        return result;
      };
      const auto k1 = rate(now, t);
      const auto k2 = rate(moved(now, k1, kStep_s / 2), t + kStep_s / 2);
      const auto k3 = rate(moved(now, k2, kStep_s / 2), t + kStep_s / 2);
      const auto k4 = rate(moved(now, k3, kStep_s), t + kStep_s);
      now =
          moved(moved(moved(moved(now, k1, kStep_s / 6), k2, kStep_s / 3), k3, kStep_s / 3), k4, kStep_s / 6);
      for (int i = 0; i < vehicles_; ++i) {
        const Vehicle& v = now[static_cast<std::size_t>(i)];
        look(t + kStep_s, i, {v[0][0], v[1][0], v[2][0]}, {v[0][1], v[1][1], v[2][1]});
      }
    }
  }

 private:
  static constexpr double kStep_s = 0.001;
  /// Per axis: e, e', int e, and the outputs of the lags.
  using Axis = std::array<double, 6>;
  using Vehicle = std::array<Axis, 3>;
  using Loops = std::array<stability::AxisLoop, 3>;

  static std::vector<Vehicle> moved(std::vector<Vehicle> x, const std::vector<Vehicle>& by, double step) {
    for (std::size_t i = 0; i < x.size(); ++i)
      for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t c = 0; c < x[i][k].size(); ++c) x[i][k][c] += step * by[i][k][c];
    return x;
  }

  static bool has_one_lag(const stability::AxisLoop& loop) {
    int count = 0;
    for (const double tau_s : loop.lags_s) count += tau_s > 0 ? 1 : 0;
    return count == 1;
  }

  double command(const Axis& a, std::size_t vehicle, std::size_t k, const Eigen::Vector3d& planned,
                 double learned) const {
    const stability::AxisLoop& loop = loops_[vehicle][k];
    return loop.mass_kg * (planned[static_cast<int>(k)] - loop.Kp * a[0] - loop.Kd * a[1] - loop.Ki * a[2]) -
           (k == 2 ? learned : 0);
  }

  /// Draws a motor lag for each vehicle; gains_ must have a lag.
  void draw_lags(files::Random& random) {
    for (Loops& loops : loops_) {
      if (!motor_lag_s_) return;
      const double lag_s = between(random, motor_lag_s_->lower, motor_lag_s_->upper);
      for (stability::AxisLoop& loop : loops) loop.lags_s.front() = lag_s;
    }
  }

  void draw_switching(files::Random& random) {
    switching_.assign(static_cast<std::size_t>(vehicles_), {});
    for (auto& of_vehicle : switching_) {
      for (Switching& s : of_vehicle) {
        // From one switch in twenty seconds, i.e. practically none, to ten per second.
        s.rate_1_s = 0.05 * std::pow(200.0, between(random, 0, 1));
        s.phase = between(random, 0, 2);
      }
    }
  }

  /// @param quantity 0 to 2: position; 3 to 5: velocity.
  double estimate_error(int vehicle, std::size_t quantity, double time_s) const {
    const std::size_t k = quantity % 3;
    const double size = quantity < 3 ? estimates_.position_m[k] : estimates_.velocity_m_s[k];
    const Switching& s = switching_[static_cast<std::size_t>(vehicle)][quantity];
    return std::fmod(s.rate_1_s * time_s + s.phase, 2) < 1 ? size : -size;
  }

  /// Returns one end of the residual's range along each axis at the vehicle's position, switching at random times.
  Eigen::Vector3d residual_at(const std::vector<double>& state, int vehicle, double time_s) const {
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
    if (residual_ == nullptr) return force;
    std::vector<analysis::Offset> offsets(static_cast<std::size_t>(vehicles_ - 1));
    for (std::size_t n = 0; n < offsets.size(); ++n)
      for (std::size_t k = 0; k < 3; ++k) offsets[n][k] = state[n * analysis::kPerNeighbour + k];
    for (std::size_t k = 0; k < 3; ++k) {
      const Interval range = residual_->over(offsets, k);
      const Switching& s = switching_[static_cast<std::size_t>(vehicle)][k];
      force[static_cast<int>(k)] =
          std::fmod(s.rate_1_s * time_s + s.phase, 2) < 1 ? range.lower : range.upper;
    }
    return force;
  }

  /// Returns the estimated state of an axis, as seen by the control law.
  Axis estimated(Axis a, int vehicle, std::size_t k, double time_s) const {
    a[0] += estimate_error(vehicle, k, time_s);
    a[1] += estimate_error(vehicle, k + 3, time_s);
    return a;
  }

  /// @param held the command along each axis; null: it follows the state
  Vehicle derivative(const Vehicle& x, int vehicle, double time_s, const Eigen::Vector3d& force,
                     double learned, const std::array<double, 3>* held) const {
    Vehicle result{};
    const Eigen::Vector3d planned = task_.at(vehicle, time_s).a_W_m_s2;
    for (int k = 0; k < 3; ++k) {
      const auto at = static_cast<std::size_t>(k);
      const stability::AxisLoop& loop = loops_[static_cast<std::size_t>(vehicle)][at];
      const Axis& a = x[at];
      Axis& d = result[at];
      const Axis told = estimated(a, vehicle, at, time_s);
      double applied = held != nullptr
                           ? (*held)[at]
                           : command(told, static_cast<std::size_t>(vehicle), at, planned, learned);
      std::size_t c = 3;
      for (const double tau_s : loop.lags_s) {
        if (tau_s <= 0) continue;
        d[c] = (applied - a[c]) / tau_s;
        applied = a[c++];
      }
      d[0] = a[1];
      d[1] = (applied + force[k]) / loop.mass_kg - planned[k];
      d[2] = told[0];
    }
    return result;
  }

  /// @param is_told include the errors of the estimates
  std::vector<double> state(const std::vector<Vehicle>& x, int vehicle, double time_s,
                            bool is_told = false) const {
    const auto place = [&](int i, bool is_velocity) {
      const stability::Setpoint goal = task_.at(i, time_s);
      Vehicle v = x[static_cast<std::size_t>(i)];
      const std::size_t c = is_velocity ? 1 : 0;
      for (std::size_t k = 0; is_told && k < 3; ++k) v[k] = estimated(v[k], i, k, time_s);
      return Eigen::Vector3d((is_velocity ? goal.v_W_m_s : goal.p_W_m) +
                             Eigen::Vector3d(v[0][c], v[1][c], v[2][c]));
    };
    std::vector<double> result;
    for (int j = 0; j < vehicles_; ++j) {
      for (const bool is_velocity : {false, true}) {
        const Eigen::Vector3d apart = place(j, is_velocity) - place(vehicle, is_velocity);
        if (j != vehicle) result.insert(result.end(), apart.data(), apart.data() + 3);
      }
    }
    result.push_back(place(vehicle, false).z());
    const Eigen::Vector3d velocity = place(vehicle, true);
    result.insert(result.end(), velocity.data(), velocity.data() + 3);
    return result;
  }

  struct Switching {
    double rate_1_s = 0, phase = 0;
  };

  const analysis::ResidualEnvelope* residual_;
  analysis::EstimateErrors estimates_;
  std::optional<Interval> motor_lag_s_;
  std::vector<std::array<Switching, 6>> switching_;  ///< per vehicle and quantity
  const stability::Gains& gains_;
  const stability::Task& task_;
  int vehicles_;
  bool is_sampled_;
  Forces forces_;
  std::vector<Loops> loops_;  ///< per vehicle
};

}  // namespace swarmcert::tests
