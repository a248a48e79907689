/// @file The published swap: vehicles at different heights change places on a circle, passing over the centre.
#pragma once

#include "stability/tasks/task.h"

namespace swarmcert::stability {

class Swap : public Task {
 public:
  static constexpr char kName[] = "swap";
  static constexpr char kSummary[] = "cross over the centre of a circle at different heights, as published";
  explicit Swap(const TaskOptions& options);
  Setpoint at(int vehicle, double time_s) const override;
  double duration_s() const override { return duration_s_; }
  std::vector<double> knots_s() const override;

 private:
  int vehicles_;
  double duration_s_;
};

}  // namespace swarmcert::stability
