#include "stability/controller_bank.h"

#include <algorithm>
#include <type_traits>

#include "stability/flight_slot.h"
#include "stability/pilot.h"

namespace swarmcert::stability {
namespace {

using controller::FlightCommand;
using controller::FlightMemory;
using controller::FlightReference;
using controller::Measured;

using flight_slots::at;
using flight_slots::each;
using flight_slots::Fill;
using flight_slots::narrow;
using flight_slots::set;
using flight_slots::Slot;
using flight_slots::Take;

/// @param push a Pilot's.
template <typename Push, typename Scalar>
void read(const Push& push, const FlightMemory<Scalar>& memory, int lane, ControlRecord* record) {
  for (int r = 0; r < kNumRotors; ++r) record->rotor_N[r] = at(push.forces.at_N[r], lane);
  record->motors_off = push.motors_off;
  record->saturated = memory.thrust_saturated;
  record->faults = push.faults;
}

/// What read() leaves for report(). PWM is not computed in flight_step(), whose result for it nobody reads, but here,
/// by the same function of the same numbers.
template <typename Scalar>
void read_rest(const controller::ThrustMap<double>& map, const Slot<Scalar>& slot, int lane,
               ControlRecord* record) {
  using Number = std::conditional_t<std::is_same_v<Scalar, Lanes>, float, Scalar>;
  record->force_W_N = at(slot.memory.force_W_N, lane);
  record->thrust_N = at(slot.answer.wanted.thrust_N, lane);
  record->torque_B_Nm = at(slot.answer.wanted.torque_N_m, lane);
  record->integral_m_s = at(slot.memory.integral_m_s, lane);
  const controller::ThrustMap<Number> own = {static_cast<Number>(map.c00), static_cast<Number>(map.c10),
                                             static_cast<Number>(map.c01), static_cast<Number>(map.c20),
                                             static_cast<Number>(map.c11)};
  const Number volts = (record->faults & controller::kBatteryFault) != 0
                           ? Number(controller::kAssumedVoltage_V)
                           : static_cast<Number>(at(slot.measured.battery_V, lane));
  for (int r = 0; r < kNumRotors; ++r) {
    const auto force_N = static_cast<Number>(at(slot.answer.forces.at_N[r], lane));
    record->pwm[r] =
        record->motors_off ? 0 : controller::pwm_register(controller::pwm_of_force(own, force_N, volts));
  }
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

/// The lanes of up to eight vehicles of one kind. Lanes beyond the vehicles repeat the first one.
struct Group {
  std::vector<int> vehicles;
  Slot<Lanes> slot;
  /// What lanes do not hold side by side.
  struct Flags {
    std::uint32_t position_stamp_ms = 0;
    bool has_reference = false, thrust_saturated = false;
    bool operator==(const Flags& other) const {
      return position_stamp_ms == other.position_stamp_ms && has_reference == other.has_reference &&
             thrust_saturated == other.thrust_saturated;
    }
  };
  Flags flags[Lanes::kCount];
  std::vector<unsigned> parts = {Lanes::kAll};  ///< lanes, as bits, that take one path through the code
  int wait = 0;  ///< periods until all try together: lanes that disagreed tend to do so again

  std::size_t vehicle_of(int lane) const {
    const auto k = static_cast<std::size_t>(lane);
    return static_cast<std::size_t>(k < vehicles.size() ? vehicles[k] : vehicles.front());
  }
  const Flags& flags_of(int lane) const { return flags[lane < static_cast<int>(vehicles.size()) ? lane : 0]; }
};

int first_of(unsigned lanes) {
  int lane = 0;
  while ((lanes >> lane & 1) == 0) ++lane;
  return lane;
}

/// The lanes whose flags are those of the first.
unsigned alike(const Group& group, unsigned lanes) {
  const Group::Flags& first = group.flags_of(first_of(lanes));
  unsigned result = 0;
  for (int lane = 0; lane < Lanes::kCount; ++lane) {
    if ((lanes >> lane & 1) != 0 && group.flags_of(lane) == first) result |= 1U << lane;
  }
  return result;
}

/// What all lanes see of this period.
SWARMCERT_FOR_LANES void look(Group& group, const double* state, double battery_V, std::uint32_t now_ms,
                              const ControlRecord* records) {
  Slot<Lanes>& slot = group.slot;
  slot.measured.attitude_stamp_ms = now_ms;
  slot.measured.battery_V = Lanes(battery_V);
  for (int lane = 0; lane < static_cast<int>(group.vehicles.size()); ++lane) {
    see_attitude(state + group.vehicle_of(lane) * kVehicleStateSize, lane, group.vehicles.size(), &slot);
  }
  for (int lane = 0; lane < Lanes::kCount; ++lane) {
    slot.prediction_N.set(lane, static_cast<float>(records[group.vehicle_of(lane)].prediction_N));
  }
}

/// One control period of a part of a group. Where its lanes disagree nothing is changed, and those of one side are
/// returned; else 0.
template <typename Settings>
SWARMCERT_FOR_LANES unsigned step_lanes(const Settings& settings, Group& group, unsigned lanes,
                                        std::uint32_t now_ms, bool position_is_due, ControlRecord* records) {
  const Lanes::Part part(lanes);
  const bool all = lanes == Lanes::kAll;
  Slot<Lanes> own;
  if (!all) {
    each(own, group.slot, Fill{part});
    own.measured.attitude_stamp_ms = now_ms;
  }
  Slot<Lanes>& slot = all ? group.slot : own;
  const Group::Flags& flags = group.flags[first_of(lanes)];
  slot.measured.position_stamp_ms = flags.position_stamp_ms;
  FlightMemory<Lanes>& memory = slot.memory;
  const FlightMemory<Lanes> before = memory;
  memory.has_reference = flags.has_reference;
  memory.thrust_saturated = flags.thrust_saturated;
  Lanes::split = 0;
  const FlightCommand<Lanes> command =
      controller::flight_step(settings, memory, slot.measured, slot.reference,
                              {Lanes(), Lanes(), slot.prediction_N}, now_ms, position_is_due);
  memory.mean_p = before.mean_p;  // as Pilot::push()
  if (Lanes::split != 0) {
    if (all) memory = before;
    return Lanes::split & lanes;
  }
  const Pilot<Lanes>::Push push = {command.faults, command.motors_off, command.wanted, command.mixed.forces};
  slot.answer.wanted = push.wanted;
  for (int r = 0; r < kNumRotors; ++r) slot.answer.forces.at_N[r] = push.forces.at_N[r];
  if (!all) {
    each(group.slot.memory, memory, Take{part});
    each(group.slot.answer, slot.answer, Take{part});
  }
  for (std::size_t k = 0; k < group.vehicles.size(); ++k) {
    if ((lanes >> k & 1) == 0) continue;
    group.flags[k].has_reference = memory.has_reference;
    group.flags[k].thrust_saturated = memory.thrust_saturated;
    read(push, memory, static_cast<int>(k), &records[static_cast<std::size_t>(group.vehicles[k])]);
  }
  return 0;
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
    if (group_of_[i] != nullptr) {
      Measured<Lanes>& measured = group_of_[i]->slot.measured;
      set(measured.position_W_m, lane_of_[i], group_of_[i]->vehicles.size(), p_W_m);
      set(measured.velocity_W_m_s, lane_of_[i], group_of_[i]->vehicles.size(), v_W_m_s);
      group_of_[i]->flags[lane_of_[i]].position_stamp_ms = stamp_ms;
    } else {
      set(slots_[i].measured.position_W_m, p_W_m);
      set(slots_[i].measured.velocity_W_m_s, v_W_m_s);
      slots_[i].measured.position_stamp_ms = stamp_ms;
    }
  }

  void follow(int vehicle, const Setpoint& to) override {
    const auto i = static_cast<std::size_t>(vehicle);
    if (group_of_[i] != nullptr) {
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
    if (group_of_[i] != nullptr) {
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

  void report(int vehicle, ControlRecord* record) const override {
    const auto i = static_cast<std::size_t>(vehicle);
    const ThrustMap& map = swarm_.model(vehicle).thrust;
    const controller::ThrustMap<double> thrust_map = {map.c00, map.c10, map.c01, map.c20, map.c11};
    if (group_of_[i] != nullptr) {
      read_rest(thrust_map, group_of_[i]->slot, lane_of_[i], record);
    } else {
      read_rest(thrust_map, slots_[i], 0, record);
    }
  }

 private:
  static constexpr bool kLanes = std::is_same_v<Scalar, float>;

  void step_alone(std::size_t i, const double* state, double battery_V, std::uint32_t now_ms,
                  bool position_is_due, ControlRecord* record) {
    Slot<Scalar>& slot = slots_[i];
    see_attitude(state + i * kVehicleStateSize, &slot);
    slot.measured.attitude_stamp_ms = now_ms;
    slot.measured.battery_V = static_cast<Scalar>(battery_V);
    slot.prediction_N = static_cast<Scalar>(record->prediction_N);
    const typename Pilot<Scalar>::Push push =
        pilots_[static_cast<std::size_t>(swarm_.kind_of(static_cast<int>(i)))].push(
            slot.memory, slot.measured, slot.reference, slot.prediction_N, now_ms, position_is_due);
    slot.answer = {push.wanted, push.forces};
    read(push, slot.memory, 0, record);
  }

  /// As few runs through the code as there are paths that vehicles take.
  void step(Group& group, const double* state, double battery_V, std::uint32_t now_ms, bool position_is_due,
            std::vector<ControlRecord>& records) {
    constexpr int kWait = 10;
    look(group, state, battery_V, now_ms, records.data());
    if (group.parts.size() > 1 && --group.wait < 0) {
      group.parts.assign(1, Lanes::kAll);
      group.wait = kWait;
    }
    const Pilot<Lanes>& pilot =
        lane_pilots_[static_cast<std::size_t>(swarm_.kind_of(group.vehicles.front()))];
    pilot.with_settings([&](const auto& settings) {
      for (std::size_t k = 0; k < group.parts.size();) {
        const unsigned lanes = group.parts[k];
        unsigned some = alike(group, lanes);
        if (some == lanes) some = step_lanes(settings, group, lanes, now_ms, position_is_due, records.data());
        if (some == 0) {
          ++k;
        } else {
          group.parts[k] = some;
          group.parts.push_back(lanes & ~some);
        }
      }
    });
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
