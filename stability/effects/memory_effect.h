/// @file Base class and delay line of effects with a memory.
#pragma once

#include "stability/effects/effect.h"

namespace swarmcert::stability {

/// An effect whose columns depend on the past; stream() computes them.
class MemoryEffect : public Effect {
 public:
  using Effect::Effect;
  /// @throws std::logic_error always, as no column exists for a single instant.
  void columns(const Instant& now, const double* shape, Wrench* columns) const final;
  std::unique_ptr<ColumnStream> stream(const double* shape) const override = 0;
  void add_to(SignalPath& path, const double* coefficients, const double* shape) const override = 0;
};

/// The recent history of a signal of kSize numbers, read at a fixed delay. Linear interpolation between samples,
/// constant before the first. Holds the last 64 samples: at most 0.64 s at 100 Hz.
template <int kSize>
class DelayLine {
 public:
  using Value = Eigen::Matrix<double, kSize, 1>;

  void restart() { count_ = 0; }
  void push(double time_s, const Value& value) {
    const int at = count_++ % kCapacity;
    times_s_[at] = time_s;
    values_[at] = value;
  }
  /// Precondition: push() was called since restart().
  Value at(double time_s) const {
    const int oldest = count_ > kCapacity ? count_ - kCapacity : 0;
    int k = count_ - 1;
    while (k > oldest && times_s_[k % kCapacity] > time_s) --k;
    const int a = k % kCapacity;
    if (k == count_ - 1 || times_s_[a] >= time_s) return values_[a];
    const int b = (k + 1) % kCapacity;
    const double share = (time_s - times_s_[a]) / (times_s_[b] - times_s_[a]);
    return values_[a] + share * (values_[b] - values_[a]);
  }

 private:
  static constexpr int kCapacity = 64;
  int count_ = 0;
  double times_s_[kCapacity];
  Value values_[kCapacity];
};

}  // namespace swarmcert::stability
