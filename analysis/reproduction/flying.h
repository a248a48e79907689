/// @file Simulated flights under a truth, with the state at every position period.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "analysis/reproduction/setting.h"
#include "nn/weights/network.h"
#include "stability/effects/deep_set_force.h"
#include "stability/effects/effect.h"
#include "stability/simulation/flight_log.h"

namespace swarmcert::reproduction {

struct Plan {
  std::string task;
  int vehicles = 2;
  double duration_s = 0;  ///< 0: the task's own
  std::uint64_t seed = 0;
  double higher_m = 0;  ///< offset of the setpoints above those of the task
  double drawn_in = 1;  ///< factor by which setpoints are drawn towards the centre of a random walk's box
};

/// One vehicle at one position period, in the world frame.
struct Moment {
  float time_s = 0;
  Eigen::Vector3f p_m, v_m_s, p_d_m;
  float interaction_gf = 0;  ///< part of f_a,z of the truth caused by neighbours
  float prediction_gf = 0;   ///< f_hat_a,z as used in flight
};

struct Flown {
  std::vector<std::vector<Moment>> vehicles;
  std::vector<std::vector<stability::LogRecord>> logs;  ///< empty unless requested
  double saturated_share = 0;                           ///< share of the control periods of the worst vehicle
  bool diverged = false;  ///< a vehicle is more than 100 m away; the flight ends there
};

/// @param network its prediction is fed forward; nullptr: none.
Flown fly(const Setting& setting, const Truth& truth, const Plan& plan, const files::Network* network,
          bool keep_logs);

/// Returns the largest error along `axis` over all vehicles, m; infinite if the flight diverged.
double largest_error_m(const Flown& flown, int axis);

/// Returns the distances from each vehicle to its nearest neighbour at each moment, m; ascending.
std::vector<float> nearest_distances_m(const Flown& flown);

/// Relative position and velocity of one neighbour, in the world frame.
using Relative = std::array<double, 6>;

/// Vertical force of neighbours on a vehicle in gram-force, as a function of their relative states alone.
class Interaction {
 public:
  explicit Interaction(const Truth& truth);
  explicit Interaction(const files::Network& network);
  Interaction(Interaction&&) noexcept;
  ~Interaction();

  double force_z_gf(const std::vector<Relative>& neighbours);

 private:
  std::vector<std::unique_ptr<stability::AppliedEffect>> effects_;
  std::unique_ptr<stability::DeepSetForce> network_;
  double mass_kg_ = 0.034;
};

}  // namespace swarmcert::reproduction
