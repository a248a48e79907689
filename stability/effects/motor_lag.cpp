/// @file Rotors follow their command with a first-order lag: tau x' = u - x, f = c (x - T) b3 and torque likewise.
#include <cmath>

#include "stability/effects/effect_entry.h"
#include "stability/effects/memory_effect.h"
#include "stability/effects/signal_path.h"

namespace swarmcert::stability {
namespace {

using Vector4 = Eigen::Matrix<double, 4, 1>;

class MotorLagStream : public ColumnStream {
 public:
  explicit MotorLagStream(double tau_s) : tau_s_(tau_s) {}

  void restart() override { has_past_ = false; }

  /// Exact for a command that is linear between the samples.
  void advance(const Instant& now, Wrench* columns) override {
    Vector4 input;
    input << now.thrust_N, now.torque_B_Nm;
    if (!has_past_) {
      lagged_ = input;
    } else if (const double h = now.time_s - time_s_; h > 0) {
      if (h != step_s_) {
        step_s_ = h;
        decay_ = std::exp(-h / tau_s_);
        in_steps_ = tau_s_ / h;
      }
      const Vector4 ramp = in_steps_ * (input - input_);
      lagged_ = input - ramp + decay_ * (lagged_ - input_ + ramp);
    }
    has_past_ = true;
    time_s_ = now.time_s;
    input_ = input;
    const Vector4 change = lagged_ - input;
    columns[0] = {change[0] * now.b3_W(), change.tail<3>()};
  }

 private:
  const double tau_s_;
  bool has_past_ = false;
  double time_s_ = 0, step_s_ = 0, decay_ = 1, in_steps_ = 0;  ///< the last: tau in steps
  Vector4 input_, lagged_;
};

class MotorLag : public MemoryEffect {
 public:
  MotorLag()
      : MemoryEffect({"motor_lag",
                      "f = c (x - T) b3, tau x' = T - x; torque likewise",
                      "published system identification 1 / tau = 16 .. 17.4 1/s; rotor speeds of brushed "
                      "motors 70 .. 90 ms",
                      "motor_lag",
                      "vertical commands with content at 2 .. 8 Hz",
                      {{"gain", "1 is a pure lag; a fit far from 1 indicates another cause", 1, 0, 1.3}},
                      {{"tau_s",
                        "time constant",
                        1 / 17.4,
                        0.001,
                        1,
                        {0.015, 0.03, 0.04, 0.05, 0.06, 0.07, 0.08, 0.1}}},
                      true},
                     {Family::kLate,
                      Family::kNone,
                      ShownBy::kForce,
                      SetPoints::kBesideRemainder,
                      {},
                      Place::kThrust}) {}
  std::unique_ptr<ColumnStream> stream(const double* shape) const override {
    return std::make_unique<MotorLagStream>(shape[0]);
  }
  void add_to(SignalPath& path, const double* coefficients, const double* shape) const override {
    path.motor_lag_s = shape[0];
    path.motor_lag_gain = coefficients[0];
  }
};

}  // namespace

EffectEntry effects::motor_lag() { return effect_entry<MotorLag>(); }

}  // namespace swarmcert::stability
