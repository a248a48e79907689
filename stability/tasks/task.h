/// @file A flight task: the reference trajectory of each vehicle.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "nn/base/interval.h"

namespace swarmcert::stability {

/// The reference for a controller at one instant, in the world frame.
struct Setpoint {
  Eigen::Vector3d p_W_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d v_W_m_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d a_W_m_s2 = Eigen::Vector3d::Zero();
};

/// Enclosure of a setpoint over a time interval, axis by axis.
struct SetpointRange {
  Interval p_W_m[3], v_W_m_s[3], a_W_m_s2[3], jerk_W_m_s3[3];
};

/// Trajectories of a number of vehicles. Positions are continuous; velocities jump only at knots().
class Task {
 public:
  virtual ~Task() = default;
  virtual Setpoint at(int vehicle, double time_s) const = 0;
  virtual double duration_s() const = 0;
  /// Times at which some vehicle's acceleration or its derivative jumps; integrators should stop there.
  virtual std::vector<double> knots_s() const { return {}; }
  /// Returns an enclosure of at(), and of the derivative of its acceleration, over [from_s, to_s]. The acceleration
  /// must be continuous there. Returns nothing if the task has no enclosure.
  virtual std::optional<SetpointRange> over(int vehicle, double from_s, double to_s) const;
  /// Returns true if vehicles start on the ground, below their first setpoint.
  virtual bool starts_on_ground() const { return false; }
};

struct TaskOptions {
  int vehicles = 1;
  double duration_s = 0;  ///< 0: the task's default
  std::uint64_t seed = 0;
};

/// A task with a selectable duration.
class TimedTask : public Task {
 public:
  /// @param own_s default duration.
  TimedTask(const TaskOptions& options, double own_s)
      : vehicles_(options.vehicles), duration_s_(options.duration_s > 0 ? options.duration_s : own_s) {}
  double duration_s() const override { return duration_s_; }

 protected:
  int vehicles_;
  double duration_s_;
};

/// Names of the tasks, in the order of the documentation.
std::vector<std::string> task_names();

/// Returns a one-line description of a task.
/// @throws std::invalid_argument for an unknown name.
std::string task_summary(const std::string& name);

/// @throws std::invalid_argument for an unknown name, no vehicles, or a negative duration.
std::unique_ptr<Task> make_task(const std::string& name, const TaskOptions& options);

}  // namespace swarmcert::stability
