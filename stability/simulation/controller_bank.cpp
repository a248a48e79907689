#include "stability/simulation/controller_bank.h"

#include <algorithm>
#include <type_traits>

#include "stability/simulation/flight_slot.h"
#include "stability/simulation/pilot.h"

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

/// Fills in what step() leaves to report(). PWM is not computed in flight_step(), where nobody reads it, but here, by
/// the same function of the same numbers.
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

/// @param x the vehicle's entries in the rows of the swarm's state.
template <typename Scalar>
void see_attitude(const double* x, Slot<Scalar>* slot) {
  const auto at = [x](int component) { return x[component * kRowLength]; };
  double R[9];
  rotation_of(at(kQuaternion), at(kQuaternion + 1), at(kQuaternion + 2), at(kQuaternion + 3), R);
  slot->measured.attitude = {{narrow<Scalar>({R[0], R[1], R[2]}), narrow<Scalar>({R[3], R[4], R[5]}),
                              narrow<Scalar>({R[6], R[7], R[8]})},
                             narrow<Scalar>({at(kOmega), at(kOmega + 1), at(kOmega + 2)})};
}

/// The lanes of up to eight vehicles of one kind. Unused lanes repeat the first vehicle.
struct Group {
  explicit Group(std::vector<int> of)
      : vehicles(std::move(of)), filled((1U << vehicles.size()) - 1), is_line(vehicles[0] % kRowLength == 0) {
    for (std::size_t k = 0; k < vehicles.size(); ++k) {
      is_line = is_line && vehicles[k] == vehicles[0] + static_cast<int>(k);
    }
  }

  std::vector<int> vehicles;
  Lanes::Part filled;  ///< the lanes occupied by vehicles
  bool is_line;        ///< the lanes coincide with one line in the rows of the swarm's state
  Slot<Lanes> slot;
  /// Rows of `news`.
  enum News : int {
    kSeenPosition = 0,
    kSeenVelocity = 3,
    kWantedPosition = 6,
    kWantedVelocity = 9,
    kWantedAcceleration = 12,
    kNumNews = 15
  };
  Rows news{kNumNews};  ///< inputs of see() and follow()
  bool has_news = false;
  void put(int row, int lane, const Eigen::Vector3d& v) {
    for (int axis = 0; axis < 3; ++axis) news.data()[(row + axis) * kRowLength + lane] = v[axis];
    has_news = true;
  }
  /// Per-vehicle data that are not kept in lanes.
  struct Flags {
    std::uint32_t position_stamp_ms = 0;
    bool has_reference = false, thrust_saturated = false;
    bool operator==(const Flags& other) const {
      return position_stamp_ms == other.position_stamp_ms && has_reference == other.has_reference &&
             thrust_saturated == other.thrust_saturated;
    }
  };
  Flags flags[Lanes::kCount];
  std::vector<unsigned> parts = {Lanes::kAll};  ///< lanes, as bit masks, that take one path through the code
  int wait = 0;  ///< periods until all lanes run together again: lanes that disagreed tend to do so again

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

/// Returns the lanes whose flags equal those of the first.
unsigned alike(const Group& group, unsigned lanes) {
  const Group::Flags& first = group.flags_of(first_of(lanes));
  unsigned result = 0;
  for (int lane = 0; lane < Lanes::kCount; ++lane) {
    if ((lanes >> lane & 1) != 0 && group.flags_of(lane) == first) result |= 1U << lane;
  }
  return result;
}

/// Updates the inputs of all lanes for this period.
SWARMCERT_FOR_LANES void look(Group& group, const double* rows, double battery_V, std::uint32_t now_ms) {
  Slot<Lanes>& slot = group.slot;
  slot.measured.attitude_stamp_ms = now_ms;
  slot.measured.battery_V = Lanes(battery_V);
  alignas(kRowLength * sizeof(double)) double gathered[7 * kRowLength];
  static_assert(kOmega == kQuaternion + 4 && kRowLength == Lanes::kCount);
  const double* seen = rows + row_index(group.vehicles[0], kVehicleStateSize) + kQuaternion * kRowLength;
  if (!group.is_line) {
    for (int lane = 0; lane < Lanes::kCount; ++lane) {
      const double* const x = rows + row_index(static_cast<int>(group.vehicle_of(lane)), kVehicleStateSize) +
                              kQuaternion * kRowLength;
      for (int c = 0; c < 7; ++c) gathered[c * kRowLength + lane] = x[c * kRowLength];
    }
    seen = gathered;
  }
  const auto row = [seen](int c) { return DoubleLanes(seen + c * kRowLength); };
  DoubleLanes R[9];
  rotation_of(row(0), row(1), row(2), row(3), R);
  const auto vector = [&group](const DoubleLanes& x, const DoubleLanes& y, const DoubleLanes& z) {
    const auto lanes = [&group](const DoubleLanes& wide) { return wide.rounded().filled(group.filled); };
    return controller::Vector3<Lanes>{lanes(x), lanes(y), lanes(z)};
  };
  slot.measured.attitude.R_WB.x = vector(R[0], R[1], R[2]);
  slot.measured.attitude.R_WB.y = vector(R[3], R[4], R[5]);
  slot.measured.attitude.R_WB.z = vector(R[6], R[7], R[8]);
  slot.measured.attitude.omega_B_rad_s = vector(row(4), row(5), row(6));
  if (!group.has_news) return;
  group.has_news = false;
  const auto told = [&](int first) {
    const auto news = [&group](int c) { return DoubleLanes(group.news.data() + c * kRowLength); };
    return vector(news(first), news(first + 1), news(first + 2));
  };
  slot.measured.position_W_m = told(Group::kSeenPosition);
  slot.measured.velocity_W_m_s = told(Group::kSeenVelocity);
  slot.reference.position_W_m = told(Group::kWantedPosition);
  slot.reference.velocity_W_m_s = told(Group::kWantedVelocity);
  slot.reference.acceleration_W_m_s2 = told(Group::kWantedAcceleration);
}

/// Results that all lanes of one path share.
struct Outcome {
  bool motors_off = false;
  std::uint8_t faults = 0;
};

/// Runs one control period of lanes that agree on `flags`.
/// @param keeps whether `slot` must be restored if the lanes disagree. If they agreed in the previous period, and
///     neither measurements nor references are new, only little needs to be saved.
/// @returns the lanes of one side if they disagree; else 0.
template <typename Settings>
SWARMCERT_FOR_LANES [[gnu::noinline]] unsigned fly(const Settings& settings, Slot<Lanes>& slot,
                                                   Group::Flags& flags, std::uint32_t now_ms,
                                                   bool position_is_due, bool keeps, Outcome* outcome) {
  if (settings.allocation.count != kNumRotors) __builtin_unreachable();  // lets loops over rotors unroll
  FlightMemory<Lanes>& memory = slot.memory;
  FlightMemory<Lanes> before;
  if (keeps) before = memory;
  const controller::Vector3<Lanes> rate_integral_rad = memory.rate_integral_rad;
  const Lanes mean_p = memory.mean_p;
  memory.has_reference = flags.has_reference;
  memory.thrust_saturated = flags.thrust_saturated;
  slot.measured.position_stamp_ms = flags.position_stamp_ms;
  Lanes::split = 0;
  const FlightCommand<Lanes> command = controller::flight_step(
      settings, memory, slot.measured, slot.reference, {Lanes(), Lanes(), slot.prediction_N}, now_ms,
      position_is_due, slot.torque_prediction_Nm);
  if (Lanes::split != 0) {
    if (keeps) memory = before;
    memory.rate_integral_rad = rate_integral_rad;
    memory.mean_p = mean_p;
    return static_cast<unsigned>(Lanes::split);
  }
  memory.mean_p = mean_p;  // as in Pilot::push()
  slot.answer.wanted = command.wanted;
  for (int r = 0; r < kNumRotors; ++r) slot.answer.forces.at_N[r] = command.mixed.forces.at_N[r];
  flags.has_reference = memory.has_reference;
  flags.thrust_saturated = memory.thrust_saturated;
  *outcome = {command.motors_off, command.faults};
  return 0;
}

/// Runs one control period of a subset of a group. If its lanes disagree, nothing is changed and the lanes of one side
/// are returned; else 0.
template <typename Settings>
SWARMCERT_FOR_LANES unsigned step_lanes(const Settings& settings, Group& group, unsigned lanes,
                                        std::uint32_t now_ms, bool position_is_due, bool may_differ,
                                        ControlRecord* records) {
  Group::Flags flags = group.flags[first_of(lanes)];
  Outcome common;
  if (lanes == Lanes::kAll) {
    const unsigned split = fly(settings, group.slot, flags, now_ms, position_is_due, may_differ, &common);
    if (split != 0) return split;
  } else {
    const Lanes::Part part(lanes);
    Slot<Lanes> own;
    each(own, group.slot, Fill{part});
    own.measured.attitude_stamp_ms = now_ms;
    const unsigned split = fly(settings, own, flags, now_ms, position_is_due, false, &common);
    if (split != 0) return split & lanes;
    each(group.slot.memory, own.memory, Take{part});
    each(group.slot.answer, own.answer, Take{part});
  }
  alignas(32) double rotor_N[kNumRotors][Lanes::kCount];
  for (int r = 0; r < kNumRotors; ++r) DoubleLanes::widen(group.slot.answer.forces.at_N[r], rotor_N[r]);
  for (std::size_t k = 0; k < group.vehicles.size(); ++k) {
    if ((lanes >> k & 1) == 0) continue;
    group.flags[k].has_reference = flags.has_reference;
    group.flags[k].thrust_saturated = flags.thrust_saturated;
    ControlRecord& record = records[static_cast<std::size_t>(group.vehicles[k])];
    for (int r = 0; r < kNumRotors; ++r) record.rotor_N[r] = rotor_N[r][k];
    record.motors_off = common.motors_off;
    record.saturated = flags.thrust_saturated;
    record.faults = common.faults;
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
          groups_.push_back(std::make_unique<Group>(std::vector<int>(first, last)));
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
    if (Group* const group = group_of_[i]) {
      const int lane = lane_of_[i];
      group->put(Group::kSeenPosition, lane, p_W_m);
      group->put(Group::kSeenVelocity, lane, v_W_m_s);
      group->flags[lane].position_stamp_ms = stamp_ms;
    } else {
      set(slots_[i].measured.position_W_m, p_W_m);
      set(slots_[i].measured.velocity_W_m_s, v_W_m_s);
      slots_[i].measured.position_stamp_ms = stamp_ms;
    }
  }

  void follow(int vehicle, const Setpoint& to) override {
    const auto i = static_cast<std::size_t>(vehicle);
    if (Group* const group = group_of_[i]) {
      const int lane = lane_of_[i];
      group->put(Group::kWantedPosition, lane, to.p_W_m);
      group->put(Group::kWantedVelocity, lane, to.v_W_m_s);
      group->put(Group::kWantedAcceleration, lane, to.a_W_m_s2);
    } else {
      FlightReference<Scalar>& reference = slots_[i].reference;
      set(reference.position_W_m, to.p_W_m);
      set(reference.velocity_W_m_s, to.v_W_m_s);
      set(reference.acceleration_W_m_s2, to.a_W_m_s2);
    }
  }

  void predict(int vehicle, double prediction_N, const Eigen::Vector3d& torque_B_Nm) override {
    const auto i = static_cast<std::size_t>(vehicle);
    if (group_of_[i] == nullptr) {
      slots_[i].prediction_N = static_cast<Scalar>(prediction_N);
      slots_[i].torque_prediction_Nm = narrow<Scalar>(torque_B_Nm);
      return;
    }
    for (int lane = 0; lane < Lanes::kCount; ++lane) {
      if (group_of_[i]->vehicle_of(lane) == i) {
        group_of_[i]->slot.prediction_N.set(lane, static_cast<float>(prediction_N));
        set(group_of_[i]->slot.torque_prediction_Nm, lane, torque_B_Nm);
      }
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

  void step(const double* rows, double battery_V, std::uint32_t now_ms, bool position_is_due,
            std::vector<ControlRecord>& records) override {
    if constexpr (kLanes) {
      for (const auto& group : groups_) step(*group, rows, battery_V, now_ms, position_is_due, records);
    }
    for (std::size_t i = 0; i < slots_.size(); ++i) {
      if (group_of_[i] == nullptr) step_alone(i, rows, battery_V, now_ms, position_is_due, &records[i]);
    }
  }

  void report(int vehicle, ControlRecord* record) const override {
    const auto i = static_cast<std::size_t>(vehicle);
    const ThrustMap& thrust_map = swarm_.model(vehicle).thrust;
    if (group_of_[i] != nullptr) {
      read_rest(thrust_map, group_of_[i]->slot, lane_of_[i], record);
    } else {
      read_rest(thrust_map, slots_[i], 0, record);
    }
  }

 private:
  static constexpr bool kLanes = std::is_same_v<Scalar, float>;

  void step_alone(std::size_t i, const double* rows, double battery_V, std::uint32_t now_ms,
                  bool position_is_due, ControlRecord* record) {
    Slot<Scalar>& slot = slots_[i];
    see_attitude(rows + row_index(static_cast<int>(i), kVehicleStateSize), &slot);
    slot.measured.attitude_stamp_ms = now_ms;
    slot.measured.battery_V = static_cast<Scalar>(battery_V);
    const typename Pilot<Scalar>::Push push =
        pilots_[static_cast<std::size_t>(swarm_.kind_of(static_cast<int>(i)))].push(
            slot.memory, slot.measured, slot.reference, slot.prediction_N, now_ms, position_is_due,
            slot.torque_prediction_Nm);
    slot.answer = {push.wanted, push.forces};
    for (int r = 0; r < kNumRotors; ++r) record->rotor_N[r] = static_cast<double>(push.forces.at_N[r]);
    record->motors_off = push.motors_off;
    record->saturated = slot.memory.thrust_saturated;
    record->faults = push.faults;
  }

  /// Runs the code once for each path that the vehicles take.
  void step(Group& group, const double* rows, double battery_V, std::uint32_t now_ms, bool position_is_due,
            std::vector<ControlRecord>& records) {
    constexpr int kWait = 10;
    look(group, rows, battery_V, now_ms);
    const bool tries_together = group.parts.size() > 1 && --group.wait < 0;
    if (tries_together) {
      group.parts.assign(1, Lanes::kAll);
      group.wait = kWait;
    }
    const Pilot<Lanes>& pilot =
        lane_pilots_[static_cast<std::size_t>(swarm_.kind_of(group.vehicles.front()))];
    pilot.with_settings([&](const auto& settings) {
      // Flags may differ where paths differ, and at new measurements.
      const bool may_differ = position_is_due || group.parts.size() > 1 || tries_together;
      for (std::size_t k = 0; k < group.parts.size();) {
        const unsigned lanes = group.parts[k];
        unsigned some = may_differ ? alike(group, lanes) : lanes;
        if (some == lanes) {
          some = step_lanes(settings, group, lanes, now_ms, position_is_due, may_differ, records.data());
        }
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
  std::vector<Group*> group_of_;  ///< by vehicle; nullptr: computed alone
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
