/// @file Vehicles hover side by side, 0.5 m apart, 0.6 m high.
#pragma once

#include "stability/tasks/task.h"

namespace swarmcert::stability {

class Hover : public TimedTask {
 public:
  static constexpr char kName[] = "hover";
  static constexpr char kSummary[] = "stay in place, 0.5 m apart";
  explicit Hover(const TaskOptions& options);
  Setpoint at(int vehicle, double time_s) const override;
  std::optional<SetpointRange> over(int vehicle, double from_s, double to_s) const override;
};

}  // namespace swarmcert::stability
