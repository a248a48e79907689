/// @file The published swap: vehicles at different heights change places on a circle, passing over the centre.
#pragma once

#include "stability/tasks/task.h"

namespace swarmcert::stability {

class Swap : public TimedTask {
 public:
  static constexpr char kName[] = "swap";
  static constexpr char kSummary[] = "cross over the centre of a circle at different heights, as published";
  explicit Swap(const TaskOptions& options);
  Setpoint at(int vehicle, double time_s) const override;
  std::optional<SetpointRange> over(int vehicle, double from_s, double to_s) const override;
  std::vector<double> knots_s() const override;

 private:
  std::vector<Eigen::Vector3d> sides_m_;  ///< by vehicle: where it starts, its height included
};

}  // namespace swarmcert::stability
