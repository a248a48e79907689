#include "stability/simulation/swarm.h"

#include <gtest/gtest.h>

#include <random>

#include "stability/effects/signal_path.h"
#include "stability/vehicle.h"

namespace swarmcert::stability {
namespace {

EffectSpec an_effect(const std::string& name, const std::map<std::string, double>& parameters = {}) {
  EffectSpec spec;
  spec.name = name;
  spec.parameters = parameters;
  return spec;
}

/// The definition of Swarm::runge_kutta(), stage by stage.
std::vector<double> stepped(Swarm& swarm, double h, const std::vector<VehicleInput>& inputs,
                            const std::vector<double>& start) {
  const std::size_t size = start.size();
  std::vector<double> next = start, k(size), sum(size), result = start;
  for (int stage = 0; stage < 4; ++stage) {
    swarm.derivative(0, next.data(), inputs.data(), k.data());
    for (std::size_t c = 0; c < size; ++c) {
      sum[c] = stage == 0 ? k[c] : stage < 3 ? sum[c] + 2 * k[c] : sum[c] + k[c];
      next[c] = start[c] + (stage < 2 ? h / 2 : h) * k[c];
      if (stage == 3) result[c] = start[c] + h / 6 * sum[c];
    }
  }
  return result;
}

TEST(Swarm, ItsSignalPathHasTheLagsAndDelaysOfTheModelsEffects) {
  Model model = tests::small_vehicle();
  model.effects = {an_effect("motor_lag", {{"tau_s", 0.04}, {"gain", 0.5}}),
                   an_effect("delay", {{"delay_s", 0.02}}), an_effect("sensor_delay", {{"delay_s", 0.01}})};
  const Swarm swarm(model, 2);
  const SignalPath& path = swarm.path(1);
  EXPECT_EQ(path.motor_lag_s, 0.04);
  EXPECT_EQ(path.motor_lag_gain, 0.5);
  EXPECT_EQ(path.delay_s, 0.02);
  EXPECT_EQ(path.delay_gain, 1);
  EXPECT_EQ(path.sensor_delay_s, 0.01);
  EXPECT_EQ(path.sensor_delay_gain, 1);
}

TEST(Swarm, ARungeKuttaStepIsThatOfItsDerivativeToTheBit) {
  // If only positions of pairs matter, the forces of two stages are computed together; with wakes that lag, or with
  // other effects, they are not. Up to sixteen vehicles are selected from registers, more from memory.
  std::mt19937_64 random(5);
  const auto uniform = [&random](double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(random);
  };
  int pushed = 0;
  for (const int vehicles : {1, 2, 5, 8, 9, 16, 19}) {
    for (const std::vector<EffectSpec>& effects :
         {std::vector<EffectSpec>{an_effect("downwash")},
          {an_effect("downwash"), an_effect("motor_lag")},
          {an_effect("downwash", {{"convection_s_m", 0.1}})},
          {an_effect("downwash"), an_effect("pendulum", {{"mass_kg", 0.006}, {"length_m", 0.3}})},
          {an_effect("downwash"), an_effect("drag_linear", {{"drag_N_s_m", 0.013}})}}) {
      for (const bool listed : {false, true}) {
        Model small = tests::small_vehicle(), large = tests::small_vehicle();
        small.effects = large.effects = effects;
        large.kind = "large";
        large.mass_kg = 0.067;
        std::vector<int> kinds;
        for (int i = 0; i < vehicles; ++i) kinds.push_back(listed && i % 3 == 1 ? 1 : 0);
        Swarm swarm({small, large}, kinds);
        std::vector<double> state(static_cast<std::size_t>(swarm.state_size()));
        std::vector<VehicleInput> inputs(static_cast<std::size_t>(vehicles));
        for (int i = 0; i < vehicles; ++i) {
          double* const x = &state[static_cast<std::size_t>(i * kVehicleStateSize)];
          set_hover(swarm.model(i), {uniform(-0.1, 0.1), uniform(-0.1, 0.1), 0.3 + 0.15 * i},
                    {uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)}, x);
          for (int c = kQuaternion; c < kRotors; ++c) x[c] += uniform(-0.2, 0.2);
          for (double& command : inputs[static_cast<std::size_t>(i)].rotor_command_N)
            command = uniform(0.05, 0.15);
          inputs[static_cast<std::size_t>(i)].disturbance_W_N = {uniform(-0.1, 0.1), 0, uniform(-0.1, 0.1)};
          inputs[static_cast<std::size_t>(i)].resting = i % 4 == 3;
        }
        Rows rows = swarm.make_rows();
        swarm.to_rows(state.data(), rows.data());
        if (listed) swarm.find_neighbours(rows.data(), 0.01);
        swarm.runge_kutta(0, 0.002, 1, inputs.data(), rows.data());
        std::vector<double> together(state.size());
        swarm.from_rows(rows.data(), together.data());
        const std::vector<double> apart = stepped(swarm, 0.002, inputs, state);
        for (std::size_t c = 0; c < state.size(); ++c) {
          ASSERT_EQ(together[c], apart[c]) << vehicles << " vehicles, component " << c % kVehicleStateSize
                                           << " of number " << c / kVehicleStateSize;
        }
        pushed += swarm.effects_on(0, 0, state.data(), VehicleInput()).force_W_N.z() < -0.01;
      }
    }
  }
  EXPECT_GT(pushed, 40);
}

TEST(Swarm, ListedNeighboursChangeNoBit) {
  std::mt19937_64 random(6);
  const auto uniform = [&random](double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(random);
  };
  int pushed = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const int vehicles = 2 + trial % 9;
    Model model = tests::small_vehicle();
    model.effects = {an_effect("downwash")};
    Swarm swarm(model, vehicles);
    std::vector<double> state(static_cast<std::size_t>(swarm.state_size()));
    for (int i = 0; i < vehicles; ++i) {
      set_hover(model, {uniform(-0.4, 0.4), uniform(-0.4, 0.4), uniform(0, 2)},
                {uniform(-2, 2), uniform(-2, 2), uniform(-2, 2)},
                &state[static_cast<std::size_t>(i * kVehicleStateSize)]);
    }
    const std::vector<VehicleInput> inputs(static_cast<std::size_t>(vehicles));
    std::vector<double> all(state.size()), listed(state.size());
    Rows rows = swarm.make_rows();
    swarm.to_rows(state.data(), rows.data());
    swarm.find_neighbours(rows.data(), 0.01);
    for (int i = 0; i < vehicles; ++i) {  // positions possible within 10 ms
      for (int axis = 0; axis < 3; ++axis) {
        state[static_cast<std::size_t>(i * kVehicleStateSize + axis)] +=
            0.01 * state[static_cast<std::size_t>(i * kVehicleStateSize + kVelocity + axis)];
      }
    }
    swarm.derivative(0, state.data(), inputs.data(), listed.data());
    swarm.forget_neighbours();
    swarm.derivative(0, state.data(), inputs.data(), all.data());
    ASSERT_EQ(listed, all) << trial;
    for (int i = 0; i < vehicles; ++i) {
      pushed += all[static_cast<std::size_t>(i * kVehicleStateSize + kVelocity + 2)] < -0.1 - kGravity_m_s2;
    }
  }
  EXPECT_GT(pushed, 100);
}

}  // namespace
}  // namespace swarmcert::stability
