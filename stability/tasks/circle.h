/// @file Vehicles follow one another on a circle of radius 0.5 m, 0.6 m high, one turn in 6 s.
#pragma once

#include "stability/tasks/task.h"

namespace swarmcert::stability {

class Circle : public Task {
 public:
  static constexpr char kName[] = "circle";
  static constexpr char kSummary[] = "follow one another on a circle, one turn in 6 s";
  explicit Circle(const TaskOptions& options);
  Setpoint at(int vehicle, double time_s) const override;
  double duration_s() const override { return duration_s_; }
  std::vector<double> knots_s() const override;

 private:
  int vehicles_;
  double duration_s_;
};

}  // namespace swarmcert::stability
