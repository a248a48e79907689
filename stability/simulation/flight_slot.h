/// @file Inputs and memory of the flight code for one vehicle, or for eight in SIMD lanes.
#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "stability/simulation/pilot.h"

namespace swarmcert::stability::flight_slots {

template <typename Scalar>
controller::Vector3<Scalar> narrow(const Eigen::Vector3d& v) {
  return {static_cast<Scalar>(v.x()), static_cast<Scalar>(v.y()), static_cast<Scalar>(v.z())};
}

/// What logs want of the last period.
template <typename Scalar>
struct Answer {
  controller::Wrench<Scalar> wanted{};
  controller::RotorForces<Scalar> forces{};
};

/// What flight_step() reads and writes for one vehicle, or for the lanes of several.
template <typename Scalar>
struct Slot {
  controller::FlightMemory<Scalar> memory;
  controller::Measured<Scalar> measured{};
  controller::FlightReference<Scalar> reference{};
  Scalar prediction_N{};
  controller::Vector3<Scalar> torque_prediction_Nm{};
  Answer<Scalar> answer;
};

// What happens to every number of a slot.
struct Fill {
  const Lanes::Part& part;
  SWARMCERT_LANE void operator()(Lanes& to, const Lanes& from) const { to = from.filled(part); }
};
struct Take {
  const Lanes::Part& part;
  SWARMCERT_LANE void operator()(Lanes& to, const Lanes& from) const { to.take(from, part); }
};

template <typename Copy>
void each(controller::Vector3<Lanes>& to, const controller::Vector3<Lanes>& from, const Copy& copy) {
  copy(to.x, from.x);
  copy(to.y, from.y);
  copy(to.z, from.z);
}

template <typename Copy>
void each(controller::Matrix3<Lanes>& to, const controller::Matrix3<Lanes>& from, const Copy& copy) {
  each(to.x, from.x, copy);
  each(to.y, from.y, copy);
  each(to.z, from.z, copy);
}

template <typename Copy>
void each(controller::FlightReference<Lanes>& to, const controller::FlightReference<Lanes>& from,
          const Copy& copy) {
  each(to.position_W_m, from.position_W_m, copy);
  each(to.velocity_W_m_s, from.velocity_W_m_s, copy);
  each(to.acceleration_W_m_s2, from.acceleration_W_m_s2, copy);
  copy(to.heading.cosine, from.heading.cosine);
  copy(to.heading.sine, from.heading.sine);
  each(to.omega_R_rad_s, from.omega_R_rad_s, copy);
  each(to.omega_dot_R_rad_s2, from.omega_dot_R_rad_s2, copy);
}

/// All but the flags, which are one for all lanes.
template <typename Copy>
void each(controller::FlightMemory<Lanes>& to, const controller::FlightMemory<Lanes>& from,
          const Copy& copy) {
  each(to.integral_m_s, from.integral_m_s, copy);
  each(to.rate_integral_rad, from.rate_integral_rad, copy);
  each(to.force_W_N, from.force_W_N, copy);
  each(to.R_WR, from.R_WR, copy);
  each(to.last_reference, from.last_reference, copy);
  copy(to.mean_p, from.mean_p);
}

template <typename Copy>
void each(Answer<Lanes>& to, const Answer<Lanes>& from, const Copy& copy) {
  copy(to.wanted.thrust_N, from.wanted.thrust_N);
  each(to.wanted.torque_N_m, from.wanted.torque_N_m, copy);
  for (int r = 0; r < kNumRotors; ++r) copy(to.forces.at_N[r], from.forces.at_N[r]);
}

/// What flight_step() reads, but for the stamps and the flags.
template <typename Copy>
void each(Slot<Lanes>& to, const Slot<Lanes>& from, const Copy& copy) {
  each(to.memory, from.memory, copy);
  each(to.measured.position_W_m, from.measured.position_W_m, copy);
  each(to.measured.velocity_W_m_s, from.measured.velocity_W_m_s, copy);
  each(to.measured.attitude.R_WB, from.measured.attitude.R_WB, copy);
  each(to.measured.attitude.omega_B_rad_s, from.measured.attitude.omega_B_rad_s, copy);
  copy(to.measured.battery_V, from.measured.battery_V);
  each(to.reference, from.reference, copy);
  copy(to.prediction_N, from.prediction_N);
  each(to.torque_prediction_Nm, from.torque_prediction_Nm, copy);
}

template <typename Scalar>
void set(controller::Vector3<Scalar>& to, const Eigen::Vector3d& from) {
  to = narrow<Scalar>(from);
}

inline void set(controller::Vector3<Lanes>& to, int lane, const Eigen::Vector3d& from) {
  to.x.set(lane, static_cast<float>(from.x()));
  to.y.set(lane, static_cast<float>(from.y()));
  to.z.set(lane, static_cast<float>(from.z()));
}

/// In the vehicle's lane; for the first vehicle also in those that repeat it.
inline void set(controller::Vector3<Lanes>& to, int lane, std::size_t vehicles, const Eigen::Vector3d& from) {
  set(to, lane, from);
  if (lane != 0) return;
  for (int spare = static_cast<int>(vehicles); spare < Lanes::kCount; ++spare) set(to, spare, from);
}

/// One vehicle's number out of a result, alone or in a lane.
inline double at(float x, int) { return static_cast<double>(x); }
inline double at(double x, int) { return x; }
inline double at(const Lanes& x, int lane) { return static_cast<double>(x[lane]); }

template <typename Scalar>
Eigen::Vector3d at(const controller::Vector3<Scalar>& v, int lane) {
  return {at(v.x, lane), at(v.y, lane), at(v.z, lane)};
}

}  // namespace swarmcert::stability::flight_slots
