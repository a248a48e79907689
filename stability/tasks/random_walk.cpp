/// @file Random goals in a box, kept apart by an artificial potential: the published data collection.
#include <algorithm>
#include <cmath>

#include "nn/base/random.h"
#include "stability/tasks/task.h"
#include "stability/tasks/task_entry.h"

namespace swarmcert::stability {
namespace {

// The published data collection: random goals in a box, approached under artificial potentials with limited
// acceleration and speed. A new goal is drawn when half the flight time to the current one has passed.
constexpr double kStep_s = 0.01;
constexpr double kLowest_m = 0.3;  ///< of the box; it is 0.6 m high
constexpr double kHeight_m = 0.6;
/// The box of a single vehicle, as in the published flights of single vehicles: low, within ground effect.
constexpr double kLowestAlone_m = 0.08, kHeightAlone_m = 0.3;
constexpr double kPull_1_s2 = 8, kDamping_1_s = 4;
constexpr double kSafe_m = 0.45;     ///< vehicles closer than this repel each other
constexpr double kRepulsion = 0.25;  ///< m^3/s^2
constexpr double kMostAcceleration_m_s2 = 1, kMostSpeed_m_s = 0.25;
/// Height differences are weighted less, so that vehicles fly below each other, which is the purpose of the data.
constexpr double kHeightWeight = 0.5;

double limited(double value, double limit) { return std::clamp(value, -limit, limit); }

struct Walker {
  Eigen::Vector3d p, v, goal;
  double next_goal_s = 0;
};

Eigen::Vector3d random_place(files::Random& random, double side_m, double lowest_m, double height_m) {
  const double x_m = side_m / 2 * random.symmetric(), y_m = side_m / 2 * random.symmetric();
  return {x_m, y_m, lowest_m + height_m * random.uniform()};
}

/// Returns the repulsion on a vehicle at `p` from one at `q`.
Eigen::Vector3d repulsion(const Eigen::Vector3d& p, const Eigen::Vector3d& q) {
  Eigen::Vector3d apart = p - q;
  apart.z() /= kHeightWeight;
  const double distance_m = std::max(apart.norm(), 0.05);
  if (distance_m >= kSafe_m) return Eigen::Vector3d::Zero();
  return kRepulsion * (1 / distance_m - 1 / kSafe_m) / (distance_m * distance_m * distance_m) * apart;
}

class RandomWalk : public Task {
 public:
  static constexpr char kName[] = "random-walk";
  static constexpr char kSummary[] = "random goals in a box, kept apart by artificial potentials";
  explicit RandomWalk(const TaskOptions& options)
      : duration_s_(options.duration_s > 0 ? options.duration_s : 60) {
    const double side_m = options.vehicles <= 2 ? 0.2 : 0.3;
    const bool alone = options.vehicles == 1;
    const double lowest_m = alone ? kLowestAlone_m : kLowest_m, height_m = alone ? kHeightAlone_m : kHeight_m;
    std::vector<files::Random> random;
    std::vector<Walker> walkers;
    for (int i = 0; i < options.vehicles; ++i) {
      random.emplace_back(files::Random(options.seed + static_cast<std::uint64_t>(i)).bits());
      // Vehicles start apart, stacked above the box.
      const double share = (i + 0.5) / options.vehicles;
      Walker walker;
      walker.p = random_place(random.back(), side_m, lowest_m, height_m);
      walker.p.z() = lowest_m + height_m * share;
      walker.v = Eigen::Vector3d::Zero();
      walker.goal = walker.p;
      walkers.push_back(walker);
    }
    samples_.resize(walkers.size());
    const int steps = static_cast<int>(std::ceil(duration_s_ / kStep_s)) + 1;
    std::vector<Eigen::Vector3d> accelerations(walkers.size());
    for (int k = 0; k <= steps; ++k) {
      const double time_s = k * kStep_s;
      for (std::size_t i = 0; i < walkers.size(); ++i) {
        Walker& walker = walkers[i];
        if (time_s >= walker.next_goal_s) {
          walker.goal = random_place(random[i], side_m, lowest_m, height_m);
          walker.next_goal_s = time_s + std::max((walker.goal - walker.p).norm() / 0.3, 2.0) / 2;
        }
        Eigen::Vector3d a = kPull_1_s2 * (walker.goal - walker.p) - kDamping_1_s * walker.v;
        for (std::size_t j = 0; j < walkers.size(); ++j) {
          if (j != i) a += repulsion(walker.p, walkers[j].p);
        }
        for (int axis = 0; axis < 3; ++axis) {
          const double wanted_m_s = walker.v[axis] + kStep_s * limited(a[axis], kMostAcceleration_m_s2);
          a[axis] = (limited(wanted_m_s, kMostSpeed_m_s) - walker.v[axis]) / kStep_s;
        }
        accelerations[i] = a;
        samples_[i].push_back({walker.p, walker.v, a});
      }
      for (std::size_t i = 0; i < walkers.size(); ++i) {
        walkers[i].p += kStep_s * (walkers[i].v + 0.5 * kStep_s * accelerations[i]);
        walkers[i].v += kStep_s * accelerations[i];
      }
    }
  }
  Setpoint at(int vehicle, double time_s) const override {
    const std::vector<Setpoint>& samples = samples_[static_cast<std::size_t>(vehicle)];
    const double at = std::clamp(time_s / kStep_s, 0.0, static_cast<double>(samples.size() - 1));
    const Setpoint& sample = samples[static_cast<std::size_t>(at)];
    const double rest_s = (at - std::floor(at)) * kStep_s;
    return {sample.p_W_m + rest_s * (sample.v_W_m_s + 0.5 * rest_s * sample.a_W_m_s2),
            sample.v_W_m_s + rest_s * sample.a_W_m_s2, sample.a_W_m_s2};
  }
  double duration_s() const override { return duration_s_; }

 private:
  std::vector<std::vector<Setpoint>> samples_;  ///< by vehicle, every kStep_s
  double duration_s_;
};

}  // namespace

TaskEntry tasks::random_walk() { return task_entry<RandomWalk>(); }

}  // namespace swarmcert::stability
