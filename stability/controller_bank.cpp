#include "stability/controller_bank.h"

#include <algorithm>
#include <type_traits>

#include "stability/pilot.h"

namespace swarmcert::stability {
namespace {

using controller::FlightCommand;
using controller::FlightMemory;
using controller::FlightReference;
using controller::Measured;

template <typename Scalar>
controller::Vector3<Scalar> narrow(const Eigen::Vector3d& v) {
  return {static_cast<Scalar>(v.x()), static_cast<Scalar>(v.y()), static_cast<Scalar>(v.z())};
}

/// What flight_step() reads and writes for one vehicle, or for the lanes of several.
template <typename Scalar>
struct Slot {
  FlightMemory<Scalar> memory;
  Measured<Scalar> measured{};
  FlightReference<Scalar> reference{};
  Scalar prediction_N{};
};

// Copies between one lane and one vehicle: the same list of numbers, whichever way.
struct ToLane {
  int lane;
  void operator()(Lanes& lanes, const float& x) const { lanes.set(lane, x); }
};
struct FromLane {
  int lane;
  void operator()(const Lanes& lanes, float& x) const { x = lanes[lane]; }
};

template <typename A, typename B, typename Copy>
void each(controller::Vector3<A>& a, controller::Vector3<B>& b, const Copy& copy) {
  copy(a.x, b.x);
  copy(a.y, b.y);
  copy(a.z, b.z);
}

template <typename A, typename B, typename Copy>
void each(controller::Matrix3<A>& a, controller::Matrix3<B>& b, const Copy& copy) {
  each(a.x, b.x, copy);
  each(a.y, b.y, copy);
  each(a.z, b.z, copy);
}

template <typename A, typename B, typename Copy>
void each(FlightReference<A>& a, FlightReference<B>& b, const Copy& copy) {
  each(a.position_W_m, b.position_W_m, copy);
  each(a.velocity_W_m_s, b.velocity_W_m_s, copy);
  each(a.acceleration_W_m_s2, b.acceleration_W_m_s2, copy);
  copy(a.heading.cosine, b.heading.cosine);
  copy(a.heading.sine, b.heading.sine);
  each(a.omega_R_rad_s, b.omega_R_rad_s, copy);
  each(a.omega_dot_R_rad_s2, b.omega_dot_R_rad_s2, copy);
}

/// All but the stamps and the flags, which lanes share.
template <typename A, typename B, typename Copy>
void each(Slot<A>& a, Slot<B>& b, const Copy& copy) {
  each(a.memory.integral_m_s, b.memory.integral_m_s, copy);
  each(a.memory.rate_integral_rad, b.memory.rate_integral_rad, copy);
  each(a.memory.force_W_N, b.memory.force_W_N, copy);
  each(a.memory.R_WR, b.memory.R_WR, copy);
  each(a.memory.last_reference, b.memory.last_reference, copy);
  copy(a.memory.mean_p, b.memory.mean_p);
  each(a.measured.position_W_m, b.measured.position_W_m, copy);
  each(a.measured.velocity_W_m_s, b.measured.velocity_W_m_s, copy);
  each(a.measured.attitude.R_WB, b.measured.attitude.R_WB, copy);
  each(a.measured.attitude.omega_B_rad_s, b.measured.attitude.omega_B_rad_s, copy);
  copy(a.measured.battery_V, b.measured.battery_V);
  each(a.reference, b.reference, copy);
  copy(a.prediction_N, b.prediction_N);
}

template <typename Scalar>
void set(controller::Vector3<Scalar>& to, const Eigen::Vector3d& from) {
  to = narrow<Scalar>(from);
}

void set(controller::Vector3<Lanes>& to, int lane, const Eigen::Vector3d& from) {
  to.x.set(lane, static_cast<float>(from.x()));
  to.y.set(lane, static_cast<float>(from.y()));
  to.z.set(lane, static_cast<float>(from.z()));
}

/// In the vehicle's lane; for the first vehicle also in those that repeat it.
void set(controller::Vector3<Lanes>& to, int lane, std::size_t vehicles, const Eigen::Vector3d& from) {
  set(to, lane, from);
  if (lane != 0) return;
  for (int spare = static_cast<int>(vehicles); spare < Lanes::kCount; ++spare) set(to, spare, from);
}

/// One vehicle's number out of a result, alone or in a lane.
double at(float x, int) { return static_cast<double>(x); }
double at(double x, int) { return x; }
double at(const Lanes& x, int lane) { return static_cast<double>(x[lane]); }
std::uint16_t at(std::uint16_t x, int) { return x; }
std::uint16_t at(const Lanes::Registers& x, int lane) { return x[lane]; }

template <typename Scalar>
Eigen::Vector3d at(const controller::Vector3<Scalar>& v, int lane) {
  return {at(v.x, lane), at(v.y, lane), at(v.z, lane)};
}

template <typename Scalar>
void read(const FlightCommand<Scalar>& command, const FlightMemory<Scalar>& memory, int lane,
          ControlRecord* record) {
  record->force_W_N = at(memory.force_W_N, lane);
  record->thrust_N = at(command.wanted.thrust_N, lane);
  record->torque_B_Nm = at(command.wanted.torque_N_m, lane);
  for (int r = 0; r < kNumRotors; ++r) {
    record->rotor_N[r] = at(command.mixed.forces.at_N[r], lane);
    record->pwm[r] = at(command.pwm[r], lane);
  }
  record->integral_m_s = at(memory.integral_m_s, lane);
  record->motors_off = command.motors_off;
  record->saturated = memory.thrust_saturated;
  record->faults = command.faults;
}

template <typename Scalar>
void see_attitude(const double* x, Slot<Scalar>* slot) {
  Eigen::Matrix3d R_WB;
  rotation_of(x + kQuaternion, &R_WB);
  slot->measured.attitude = {
      {narrow<Scalar>(R_WB.row(0)), narrow<Scalar>(R_WB.row(1)), narrow<Scalar>(R_WB.row(2))},
      narrow<Scalar>({x[kOmega], x[kOmega + 1], x[kOmega + 2]})};
}

void see_attitude(const double* x, int lane, std::size_t vehicles, Slot<Lanes>* slot) {
  Eigen::Matrix3d R_WB;
  rotation_of(x + kQuaternion, &R_WB);
  controller::AttitudeState<Lanes>& attitude = slot->measured.attitude;
  set(attitude.R_WB.x, lane, vehicles, R_WB.row(0));
  set(attitude.R_WB.y, lane, vehicles, R_WB.row(1));
  set(attitude.R_WB.z, lane, vehicles, R_WB.row(2));
  set(attitude.omega_B_rad_s, lane, vehicles, {x[kOmega], x[kOmega + 1], x[kOmega + 2]});
}

/// The lanes of up to eight vehicles of one kind.
struct Group {
  std::vector<int> vehicles;
  Slot<Lanes> slot;
  bool joined = false;  ///< the numbers are in `slot`; else in the vehicles' own
  int wait = 0;         ///< periods to go on alone: lanes that disagreed tend to do so again
};

/// Lanes beyond the vehicles repeat the first one.
std::size_t vehicle_of(const Group& group, int lane) {
  const auto k = static_cast<std::size_t>(lane);
  return static_cast<std::size_t>(k < group.vehicles.size() ? group.vehicles[k] : group.vehicles.front());
}

/// One control period of a group; false, and nothing changed, where its lanes disagree.
template <typename Settings>
SWARMCERT_FOR_LANES bool step_lanes(const Settings& settings, Group& group, const double* state,
                                    double battery_V, std::uint32_t now_ms, bool position_is_due,
                                    ControlRecord* records) {
  Slot<Lanes>& slot = group.slot;
  slot.measured.attitude_stamp_ms = now_ms;
  slot.measured.battery_V = Lanes(battery_V);
  for (int lane = 0; lane < static_cast<int>(group.vehicles.size()); ++lane) {
    see_attitude(state + vehicle_of(group, lane) * kVehicleStateSize, lane, group.vehicles.size(), &slot);
  }
  for (int lane = 0; lane < Lanes::kCount; ++lane) {
    slot.prediction_N.set(lane, static_cast<float>(records[vehicle_of(group, lane)].prediction_N));
  }
  FlightMemory<Lanes> memory = slot.memory;
  Lanes::disagreed = false;
  const FlightCommand<Lanes> command =
      controller::flight_step(settings, memory, slot.measured, slot.reference,
                              {Lanes(), Lanes(), slot.prediction_N}, now_ms, position_is_due);
  if (Lanes::disagreed) return false;
  slot.memory = memory;
  for (std::size_t k = 0; k < group.vehicles.size(); ++k) {
    read(command, memory, static_cast<int>(k), &records[static_cast<std::size_t>(group.vehicles[k])]);
  }
  return true;
}

template <typename Scalar>
class Bank : public ControllerBank {
 public:
  Bank(const Swarm& swarm, const Gains& gains, double period_s) : swarm_(swarm) {
    constexpr std::size_t kFewest = 3;  // eight lanes cost as much as two vehicles
    for (const Model& model : swarm.models()) {
      pilots_.emplace_back(gains, model, period_s);
      if (kLanes && lanes_are_fast()) lane_pilots_.emplace_back(gains, model, period_s);
    }
    const auto size = static_cast<std::size_t>(swarm.size());
    slots_.resize(size);
    group_of_.resize(size, nullptr);
    if (!lane_pilots_.empty()) {
      for (int kind = 0; kind < static_cast<int>(pilots_.size()); ++kind) {
        std::vector<int> same;
        for (int i = 0; i < swarm.size(); ++i) {
          if (swarm.kind_of(i) == kind) same.push_back(i);
        }
        for (auto first = same.begin(); same.end() - first >= static_cast<std::ptrdiff_t>(kFewest);) {
          const auto last = first + std::min<std::ptrdiff_t>(Lanes::kCount, same.end() - first);
          groups_.push_back(std::make_unique<Group>());
          groups_.back()->vehicles.assign(first, last);
          first = last;
        }
      }
      for (const auto& group : groups_) {
        for (std::size_t k = 0; k < group->vehicles.size(); ++k) {
          group_of_[static_cast<std::size_t>(group->vehicles[k])] = group.get();
        }
      }
    }
    lane_of_.resize(size, 0);
    for (const auto& group : groups_) {
      for (std::size_t k = 0; k < group->vehicles.size(); ++k) {
        lane_of_[static_cast<std::size_t>(group->vehicles[k])] = static_cast<int>(k);
      }
    }
  }

  void see(int vehicle, const Eigen::Vector3d& p_W_m, const Eigen::Vector3d& v_W_m_s,
           std::uint32_t stamp_ms) override {
    const auto i = static_cast<std::size_t>(vehicle);
    if (joined(i)) {
      Measured<Lanes>& measured = group_of_[i]->slot.measured;
      set(measured.position_W_m, lane_of_[i], group_of_[i]->vehicles.size(), p_W_m);
      set(measured.velocity_W_m_s, lane_of_[i], group_of_[i]->vehicles.size(), v_W_m_s);
    } else {
      set(slots_[i].measured.position_W_m, p_W_m);
      set(slots_[i].measured.velocity_W_m_s, v_W_m_s);
    }
    slots_[i].measured.position_stamp_ms = stamp_ms;
  }

  void follow(int vehicle, const Setpoint& to) override {
    const auto i = static_cast<std::size_t>(vehicle);
    if (joined(i)) {
      FlightReference<Lanes>& reference = group_of_[i]->slot.reference;
      set(reference.position_W_m, lane_of_[i], group_of_[i]->vehicles.size(), to.p_W_m);
      set(reference.velocity_W_m_s, lane_of_[i], group_of_[i]->vehicles.size(), to.v_W_m_s);
      set(reference.acceleration_W_m_s2, lane_of_[i], group_of_[i]->vehicles.size(), to.a_W_m_s2);
    } else {
      FlightReference<Scalar>& reference = slots_[i].reference;
      set(reference.position_W_m, to.p_W_m);
      set(reference.velocity_W_m_s, to.v_W_m_s);
      set(reference.acceleration_W_m_s2, to.a_W_m_s2);
    }
  }

  void reset_integrals(int vehicle) override {
    const auto i = static_cast<std::size_t>(vehicle);
    if (joined(i)) {
      FlightMemory<Lanes>& memory = group_of_[i]->slot.memory;
      set(memory.integral_m_s, lane_of_[i], group_of_[i]->vehicles.size(), Eigen::Vector3d::Zero());
      set(memory.rate_integral_rad, lane_of_[i], group_of_[i]->vehicles.size(), Eigen::Vector3d::Zero());
    } else {
      slots_[i].memory.integral_m_s = slots_[i].memory.rate_integral_rad = {};
    }
  }

  void step(const double* state, double battery_V, std::uint32_t now_ms, bool position_is_due,
            std::vector<ControlRecord>& records) override {
    if constexpr (kLanes) {
      for (const auto& group : groups_) step(*group, state, battery_V, now_ms, position_is_due, records);
    }
    for (std::size_t i = 0; i < slots_.size(); ++i) {
      if (group_of_[i] == nullptr) step_alone(i, state, battery_V, now_ms, position_is_due, &records[i]);
    }
  }

 private:
  static constexpr bool kLanes = std::is_same_v<Scalar, float>;

  bool joined(std::size_t i) const { return group_of_[i] != nullptr && group_of_[i]->joined; }

  void step_alone(std::size_t i, const double* state, double battery_V, std::uint32_t now_ms,
                  bool position_is_due, ControlRecord* record) {
    Slot<Scalar>& slot = slots_[i];
    see_attitude(state + i * kVehicleStateSize, &slot);
    slot.measured.attitude_stamp_ms = now_ms;
    slot.measured.battery_V = static_cast<Scalar>(battery_V);
    slot.prediction_N = static_cast<Scalar>(record->prediction_N);
    const FlightCommand<Scalar> command =
        pilots_[static_cast<std::size_t>(swarm_.kind_of(static_cast<int>(i)))].step(
            slot.memory, slot.measured, slot.reference, slot.prediction_N, now_ms, position_is_due);
    read(command, slot.memory, 0, record);
  }

  void step(Group& group, const double* state, double battery_V, std::uint32_t now_ms, bool position_is_due,
            std::vector<ControlRecord>& records) {
    if (!group.joined && --group.wait < 0) join(group);
    if (group.joined && !step_together(group, state, battery_V, now_ms, position_is_due, records)) {
      part(group);
      constexpr int kWait = 10;
      group.wait = kWait;
    }
    if (group.joined) return;
    for (const int vehicle : group.vehicles) {
      const auto i = static_cast<std::size_t>(vehicle);
      step_alone(i, state, battery_V, now_ms, position_is_due, &records[i]);
    }
  }

  bool step_together(Group& group, const double* state, double battery_V, std::uint32_t now_ms,
                     bool position_is_due, std::vector<ControlRecord>& records) {
    const auto first = static_cast<std::size_t>(group.vehicles.front());
    const std::uint32_t stamp_ms = slots_[first].measured.position_stamp_ms;
    for (const int vehicle : group.vehicles) {
      if (slots_[static_cast<std::size_t>(vehicle)].measured.position_stamp_ms != stamp_ms) return false;
    }
    group.slot.measured.position_stamp_ms = stamp_ms;
    const Pilot<Lanes>& pilot =
        lane_pilots_[static_cast<std::size_t>(swarm_.kind_of(group.vehicles.front()))];
    return pilot.with_settings([&](const auto& settings) {
      return step_lanes(settings, group, state, battery_V, now_ms, position_is_due, records.data());
    });
  }

  void join(Group& group) {
    const FlightMemory<Scalar>& first = slots_[vehicle_of(group, 0)].memory;
    for (const int vehicle : group.vehicles) {
      const FlightMemory<Scalar>& memory = slots_[static_cast<std::size_t>(vehicle)].memory;
      if (memory.has_reference != first.has_reference || memory.thrust_saturated != first.thrust_saturated)
        return;
    }
    if constexpr (kLanes) {
      for (int lane = 0; lane < Lanes::kCount; ++lane) {
        each(group.slot, slots_[vehicle_of(group, lane)], ToLane{lane});
      }
    }
    group.slot.memory.has_reference = first.has_reference;
    group.slot.memory.thrust_saturated = first.thrust_saturated;
    group.joined = true;
  }

  void part(Group& group) {
    for (int lane = 0; lane < static_cast<int>(group.vehicles.size()); ++lane) {
      Slot<Scalar>& own = slots_[vehicle_of(group, lane)];
      if constexpr (kLanes) each(group.slot, own, FromLane{lane});
      own.memory.has_reference = group.slot.memory.has_reference;
      own.memory.thrust_saturated = group.slot.memory.thrust_saturated;
    }
    group.joined = false;
  }

  const Swarm& swarm_;
  std::vector<Pilot<Scalar>> pilots_;      ///< by kind
  std::vector<Pilot<Lanes>> lane_pilots_;  ///< by kind
  std::vector<Slot<Scalar>> slots_;        ///< by vehicle
  std::vector<std::unique_ptr<Group>> groups_;
  std::vector<Group*> group_of_;  ///< by vehicle; nullptr: alone
  std::vector<int> lane_of_;
};

}  // namespace

std::unique_ptr<ControllerBank> make_float_bank(const Swarm& swarm, const Gains& gains, double period_s) {
  return std::make_unique<Bank<float>>(swarm, gains, period_s);
}

std::unique_ptr<ControllerBank> make_double_bank(const Swarm& swarm, const Gains& gains, double period_s) {
  return std::make_unique<Bank<double>>(swarm, gains, period_s);
}

}  // namespace swarmcert::stability
