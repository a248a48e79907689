#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "stability/tasks/task.h"

namespace swarmcert::stability {
namespace {

TEST(Tasks, VelocityAndAccelerationAreDerivativesOfThePosition) {
  for (const std::string& name : task_names()) {
    SCOPED_TRACE(name);
    const auto task = make_task(name, {3, 0, 5});
    const double h = 1e-5;
    double moved = 0;
    for (int vehicle = 0; vehicle < 3; ++vehicle) {
      for (double t = 0.0123; t < task->duration_s() - 0.1; t += 0.0371) {
        const Setpoint before = task->at(vehicle, t - h), now = task->at(vehicle, t),
                       after = task->at(vehicle, t + h);
        // The walk's acceleration is piecewise constant: it changes by at most 1 m/s^2 within 2 h.
        ASSERT_LT(((after.p_W_m - before.p_W_m) / (2 * h) - now.v_W_m_s).norm(), 1e-4) << t;
        if (name != "random-walk") {
          ASSERT_LT(((after.v_W_m_s - before.v_W_m_s) / (2 * h) - now.a_W_m_s2).norm(), 1e-4) << t;
        }
        moved = std::max(moved, now.v_W_m_s.norm());
      }
    }
    EXPECT_EQ(moved > 0, name != "hover");
  }
}

TEST(Tasks, RangesHoldEverySetPointOfTheirTimeAndAreNarrow) {
  for (const char* const name : {"swap", "hover"}) {
    const auto task = make_task(name, {3, 0, 0});
    const auto in = [](Interval range, double x, double rounding) {
      return range.lower - rounding <= x && x <= range.upper + rounding;
    };
    double widest_m = 0;
    for (int k = 0; k < 400; ++k) {
      const double from_s = 0.0371 * k;
      const double to_s = from_s + (k % 5 == 0 ? 1.7 : 0.02);  // also over several knots
      for (int vehicle = 0; vehicle < 3; ++vehicle) {
        const auto range = task->over(vehicle, from_s, to_s);
        ASSERT_TRUE(range);
        for (int i = 0; i <= 20; ++i) {
          const double t = from_s + (to_s - from_s) * i / 20;
          const Setpoint now = task->at(vehicle, t), after = task->at(vehicle, t + 1e-6);
          for (int axis = 0; axis < 3; ++axis) {
            ASSERT_TRUE(in(range->p_W_m[axis], now.p_W_m[axis], 1e-15)) << name << t;
            ASSERT_TRUE(in(range->v_W_m_s[axis], now.v_W_m_s[axis], 1e-15)) << name << t;
            ASSERT_TRUE(in(range->a_W_m_s2[axis], now.a_W_m_s2[axis], 1e-14)) << name << t;
            const double jerk = (after.a_W_m_s2[axis] - now.a_W_m_s2[axis]) / 1e-6;
            ASSERT_TRUE(in(range->jerk_W_m_s3[axis], jerk, 1e-4)) << name << t;
          }
        }
        if (k % 5 != 0) widest_m = std::max(widest_m, range->p_W_m[0].upper - range->p_W_m[0].lower);
      }
    }
    EXPECT_LT(widest_m, 0.02 * 0.6) << "at most the peak speed times the time";
  }
  EXPECT_FALSE(make_task("circle", {2, 0, 0})->over(0, 0, 1)) << "no enclosure, no claim";
}

TEST(Tasks, SwapHasThePublishedGeometryAndTiming) {
  // multi_cfs_swap.py: two vehicles at 0.6 and 0.9 m on a circle of 0.3 m, 3 s per swap every 4.5 s, peak speed
  // 2.1875 D / T.
  const auto task = make_task("swap", {2, 0, 0});
  EXPECT_EQ(task->at(0, 0).p_W_m, Eigen::Vector3d(0.3, 0, 0.6));
  EXPECT_LT((task->at(1, 0).p_W_m - Eigen::Vector3d(0, 0.3, 0.9)).norm(), 1e-15);
  EXPECT_LT((task->at(0, 4.5).p_W_m - Eigen::Vector3d(-0.3, 0, 0.6)).norm(), 1e-12);
  EXPECT_LT((task->at(0, 9).p_W_m - Eigen::Vector3d(0.3, 0, 0.6)).norm(), 1e-12);
  EXPECT_NEAR(task->at(0, 3).v_W_m_s.norm(), 2.1875 * 0.6 / 3, 1e-12);
  EXPECT_LT(task->at(0, 3).p_W_m.head<2>().norm(), 1e-12) << "over the centre at half time";
  const double lowest[] = {0.6, 0.6, 0.35, 0.3};
  for (int n = 2; n <= 5; ++n) EXPECT_EQ(make_task("swap", {n, 0, 0})->at(0, 0).p_W_m.z(), lowest[n - 2]);
}

TEST(Tasks, RandomWalkStaysInItsLimitsAndPassesBelow) {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    const auto task = make_task("random-walk", {2, 120, seed});
    int stacked = 0;
    double nearest = 1;
    for (double t = 0; t < 120; t += 0.01) {
      const Setpoint a = task->at(0, t), b = task->at(1, t);
      for (int axis = 0; axis < 3; ++axis) {
        ASSERT_LE(std::abs(a.v_W_m_s[axis]), 0.25 + 1e-9);
        ASSERT_LE(std::abs(a.a_W_m_s2[axis]), 1 + 1e-9);
      }
      const Eigen::Vector3d apart = a.p_W_m - b.p_W_m;
      nearest = std::min(nearest, apart.norm());
      if (apart.head<2>().norm() < 0.1 && std::abs(apart.z()) < 0.6) ++stacked;
    }
    EXPECT_GT(stacked, 200) << "at least 2 s of downwash";
    EXPECT_GT(nearest, 0.08);
  }
}

TEST(Tasks, ALoneRandomWalkGoesToWhereTheGroundIsFelt) {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    const auto task = make_task("random-walk", {1, 120, seed});
    double lowest_m = 1;
    int low = 0;
    for (double t = 0; t < 120; t += 0.01) {
      const double z_m = task->at(0, t).p_W_m.z();
      lowest_m = std::min(lowest_m, z_m);
      if (z_m < 0.15) ++low;
    }
    EXPECT_GT(lowest_m, 0.06) << "above the floor";
    EXPECT_GT(low, 200) << "at least 2 s";
  }
}

}  // namespace
}  // namespace swarmcert::stability
