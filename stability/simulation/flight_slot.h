/// @file Inputs and memory of the flight code for one vehicle, or for eight in SIMD lanes.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <tuple>
#include <type_traits>

#include "stability/simulation/pilot.h"

namespace swarmcert::stability::flight_slots {

template <typename Scalar>
controller::Vector3<Scalar> narrow(const Eigen::Vector3d& v) {
  return {static_cast<Scalar>(v.x()), static_cast<Scalar>(v.y()), static_cast<Scalar>(v.z())};
}

/// Results of the last period that logs need.
template <typename Scalar>
struct Answer {
  controller::Wrench<Scalar> wanted{};
  controller::RotorForces<Scalar> forces{};
};

/// The data that flight_step() reads and writes for one vehicle, or for the lanes of several.
template <typename Scalar>
struct Slot {
  controller::FlightMemory<Scalar> memory;
  controller::Measured<Scalar> measured{};
  controller::FlightReference<Scalar> reference{};
  Scalar prediction_N{};
  controller::Vector3<Scalar> torque_prediction_Nm{};
  Answer<Scalar> answer;
};

// Operations applied to every number of a slot.
struct Fill {
  const Lanes::Part& part;
  SWARMCERT_LANE void operator()(Lanes& to, const Lanes& from) const { to = from.filled(part); }
};
struct Take {
  const Lanes::Part& part;
  SWARMCERT_LANE void operator()(Lanes& to, const Lanes& from) const { to.take(from, part); }
};

// The fields of the structs in a slot. Each binding names all fields of its type: if a field is added to the flight
// code but not listed here, this file does not compile, so the field cannot be lost when lanes are computed separately.
// Stamps and flags are the same in all lanes computed together; Group::Flags keeps them for each vehicle.
inline auto fields(controller::Vector3<Lanes>& v) {
  auto& [x, y, z] = v;
  return std::tie(x, y, z);
}
inline auto fields(controller::Matrix3<Lanes>& m) {
  auto& [x, y, z] = m;
  return std::tie(x, y, z);
}
inline auto fields(controller::Heading<Lanes>& heading) {
  auto& [cosine, sine] = heading;
  return std::tie(cosine, sine);
}
inline auto fields(controller::FlightReference<Lanes>& reference) {
  auto& [position, velocity, acceleration, heading, omega, omega_dot] = reference;
  return std::tie(position, velocity, acceleration, heading, omega, omega_dot);
}
inline auto fields(controller::AttitudeState<Lanes>& attitude) {
  auto& [R_WB, omega_B] = attitude;
  return std::tie(R_WB, omega_B);
}
inline auto fields(controller::Measured<Lanes>& measured) {
  auto& [position, velocity, position_stamp, attitude, attitude_stamp, battery_V] = measured;
  return std::tie(position, velocity, attitude, battery_V);
}
inline auto fields(controller::FlightMemory<Lanes>& memory) {
  auto& [integral, rate_integral, force, R_WR, reference, has_reference, thrust_saturated, mean_p] = memory;
  return std::tie(integral, rate_integral, force, R_WR, reference, mean_p);
}
inline auto fields(controller::Wrench<Lanes>& wrench) {
  auto& [thrust, torque] = wrench;
  return std::tie(thrust, torque);
}
inline auto fields(controller::RotorForces<Lanes>& forces) {
  auto& [f] = forces;
  static_assert(kNumRotors == 4);
  return std::tie(f[0], f[1], f[2], f[3]);
}
inline auto fields(Answer<Lanes>& answer) {
  auto& [wanted, forces] = answer;
  return std::tie(wanted, forces);
}
/// The inputs of flight_step(), without the answer.
inline auto fields(Slot<Lanes>& slot) {
  auto& [memory, measured, reference, prediction, torque_prediction, answer] = slot;
  return std::tie(memory, measured, reference, prediction, torque_prediction);
}

/// Calls copy(to, from) for every Lanes in `to`.
template <typename T, typename Copy>
void each(T& to, T& from, const Copy& copy) {
  if constexpr (std::is_same_v<T, Lanes>) {
    copy(to, from);
  } else {
    std::apply(
        [&](auto&... into) { std::apply([&](auto&... out) { (each(into, out, copy), ...); }, fields(from)); },
        fields(to));
  }
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

/// Sets the vehicle's lane and, for the first vehicle, also the unused lanes, which repeat it.
inline void set(controller::Vector3<Lanes>& to, int lane, std::size_t vehicles, const Eigen::Vector3d& from) {
  set(to, lane, from);
  if (lane != 0) return;
  for (int spare = static_cast<int>(vehicles); spare < Lanes::kCount; ++spare) set(to, spare, from);
}

/// Returns one vehicle's number from a result for a single vehicle or for lanes.
inline double at(float x, int) { return static_cast<double>(x); }
inline double at(double x, int) { return x; }
inline double at(const Lanes& x, int lane) { return static_cast<double>(x[lane]); }

template <typename Scalar>
Eigen::Vector3d at(const controller::Vector3<Scalar>& v, int lane) {
  return {at(v.x, lane), at(v.y, lane), at(v.z, lane)};
}

}  // namespace swarmcert::stability::flight_slots
