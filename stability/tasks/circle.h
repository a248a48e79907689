/// @file Vehicles follow one another on a circle of radius 0.5 m, 0.6 m high, one turn in 6 s.
#pragma once

#include "stability/tasks/task.h"

namespace swarmcert::stability {

class Circle : public TimedTask {
 public:
  static constexpr char kName[] = "circle";
  static constexpr char kSummary[] = "follow one another on a circle, one turn in 6 s";
  explicit Circle(const TaskOptions& options);
  Setpoint at(int vehicle, double time_s) const override;
  std::vector<double> knots_s() const override;
};

}  // namespace swarmcert::stability
