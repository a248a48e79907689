/// @file From the ground to 0.5 m, wait, and land: vehicles side by side, 0.5 m apart.
#pragma once

#include "stability/tasks/task.h"

namespace swarmcert::stability {

class Takeoff : public Task {
 public:
  static constexpr char kName[] = "takeoff";
  static constexpr char kSummary[] = "rise from the ground, wait, land";
  explicit Takeoff(const TaskOptions& options);
  Setpoint at(int vehicle, double time_s) const override;
  double duration_s() const override { return duration_s_; }
  std::vector<double> knots_s() const override;
  bool starts_on_ground() const override { return true; }

 private:
  double duration_s_;
};

}  // namespace swarmcert::stability
