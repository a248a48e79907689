/// @file Delayed command: f = c (T(t - d) - T) b3, and torque likewise.
#include "stability/effects/effect_entry.h"
#include "stability/effects/memory_effect.h"
#include "stability/effects/signal_path.h"

namespace swarmcert::stability {
namespace {

class DelayStream : public ColumnStream {
 public:
  explicit DelayStream(double delay_s) : delay_s_(delay_s) {}

  void restart() override { past_.restart(); }

  void advance(const Instant& now, Wrench* columns) override {
    Eigen::Vector4d input;
    input << now.thrust_N, now.torque_B_Nm;
    past_.push(now.time_s, input);
    const Eigen::Vector4d change = past_.at(now.time_s - delay_s_) - input;
    columns[0] = {change[0] * now.b3_W(), change.tail<3>()};
  }

 private:
  const double delay_s_;
  DelayLine<4> past_;
};

class Delay : public MemoryEffect {
 public:
  Delay()
      : MemoryEffect(
            {"delay",
             "f = c (T(t - d) - T) b3; torque likewise",
             "radio, computation and motor drivers; 10 .. 20 ms in published flights, in addition to the "
             "motor lag",
             "delay",
             "vertical commands with content at 2 .. 8 Hz, where a lag attenuates and a delay does not",
             {{"gain", "1 is a pure delay; a fit far from 1 indicates another cause", 1, 0, 1.3}},
             // A delay of less than one record cannot be separated from the time at which the log reads the command.
             {{"delay_s", "d", 0.01, 0, 0.5, {0.01, 0.015, 0.02, 0.025, 0.03, 0.04, 0.05, 0.06}}},
             true},
            {Family::kLate,
             Family::kNone,
             ShownBy::kForce,
             SetPoints::kBesideRemainder,
             {},
             Place::kThrust}) {}
  std::unique_ptr<ColumnStream> stream(const double* shape) const override {
    return std::make_unique<DelayStream>(shape[0]);
  }
  void add_to(SignalPath& path, const double* coefficients, const double* shape) const override {
    path.delay_s = shape[0];
    path.delay_gain = coefficients[0];
  }
};

}  // namespace

EffectEntry effects::delay() { return effect_entry<Delay>(); }

}  // namespace swarmcert::stability
