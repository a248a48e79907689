/// @file Random goals in a box, held apart by an artificial potential: the published data collection.
#pragma once

#include "stability/tasks/task.h"

namespace swarmcert::stability {

class RandomWalk : public Task {
 public:
  static constexpr char kName[] = "random-walk";
  static constexpr char kSummary[] = "random goals in a box, held apart by artificial potentials";
  explicit RandomWalk(const TaskOptions& options);
  Setpoint at(int vehicle, double time_s) const override;
  double duration_s() const override { return duration_s_; }

 private:
  std::vector<std::vector<Setpoint>> samples_;  ///< by vehicle, every kStep_s
  double duration_s_;
};

}  // namespace swarmcert::stability
