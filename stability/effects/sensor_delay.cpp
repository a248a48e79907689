/// @file Delayed accelerometer: appears in the log as the force c ((T b3)(t - d) - T b3).
#include "stability/effects/effect_entry.h"
#include "stability/effects/memory_effect.h"
#include "stability/effects/signal_path.h"

namespace swarmcert::stability {
namespace {

class SensorDelayStream : public ColumnStream {
 public:
  explicit SensorDelayStream(double delay_s) : delay_s_(delay_s) {}

  void restart() override { past_.restart(); }

  void advance(const Instant& now, Wrench* columns) override {
    const Eigen::Vector3d force_W_N = now.thrust_N * now.b3_W();
    past_.push(now.time_s, force_W_N);
    columns[0] = {past_.at(now.time_s - delay_s_) - force_W_N, Eigen::Vector3d::Zero()};
  }

 private:
  const double delay_s_;
  DelayLine<3> past_;
};

class SensorDelay : public MemoryEffect {
 public:
  SensorDelay()
      : MemoryEffect(
            {"sensor_delay",
             "r = c ((T b3)(t - d) - T b3)",
             "group delay of the accelerometer's filter: 7.5 ms for two poles at 30 Hz",
             "sensor_delay",
             "tilt of more than 5 degrees at more than 1 Hz: a motor lag does not delay the thrust axis",
             {{"gain", "1 is a pure delay; a fit far from 1 indicates another cause", 1, 0, 1.3}},
             {{"delay_s", "d", 0.0075, 0, 0.5, {0.01, 0.015, 0.02, 0.03, 0.04}}},
             true},
            {Family::kLate,
             Family::kNone,
             ShownBy::kForce,
             SetPoints::kBesideRemainder,
             {"rate_x", "rate_y"},
             Place::kLog}) {}
  std::unique_ptr<ColumnStream> stream(const double* shape) const override {
    return std::make_unique<SensorDelayStream>(shape[0]);
  }
  void add_to(SignalPath& path, const double* coefficients, const double* shape) const override {
    path.sensor_delay_s = shape[0];
    path.sensor_delay_gain = coefficients[0];
  }
};

}  // namespace

EffectEntry effects::sensor_delay() { return effect_entry<SensorDelay>(); }

}  // namespace swarmcert::stability
