#include "stability/simulation/sampled_flight.h"

#include <gtest/gtest.h>

#include <cmath>

#include "data.h"
#include "stability/effects/registry.h"
#include "stability/simulation/simulate.h"
#include "stability/vehicle.h"

namespace swarmcert::stability {
namespace {

Model with_effects(const std::vector<std::pair<std::string, std::map<std::string, double>>>& effects) {
  Model model = tests::small_vehicle();
  for (const auto& [name, parameters] : effects) {
    EffectSpec spec;
    spec.name = name;
    spec.parameters = parameters;
    model.effects.push_back(spec);
  }
  return model;
}

Gains parsed_gains(const std::string& position = "Kp = [20, 20, 10]\nKd = [10, 10, 5]\nKi = [3, 3, 10]\n") {
  return parse_gains(
      "schema = \"swarmcert/gains/1\"\n[position]\n" + position + "[attitude]\nlaw = \"lee\"\n",
      "gains.toml");
}

SampledFlightOptions exact() {
  SampledFlightOptions options;
  options.flies_float = false;
  return options;
}

TEST(SampledFlight, KeepsRotationsOrthogonalFor60s) {
  Swarm swarm(with_effects({{"downwash", {}}, {"motor_lag", {}}}), 3);
  const auto task = make_task("swap", {3, 60, 0});
  SampledFlight loop(swarm, parsed_gains(), *task, exact());
  double drift = 0, turned = 0;
  while (loop.time_s() < 60) {
    loop.step();
    for (int i = 0; i < swarm.size(); ++i) {
      const double* const q = loop.state() + i * kVehicleStateSize + kQuaternion;
      Eigen::Matrix3d R;
      rotation_of(q, &R);
      drift = std::max(drift, std::abs(std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]) - 1));
      drift = std::max(drift, (R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff());
      turned = std::max(turned, std::acos(std::min(R(2, 2), 1.0)));
    }
  }
  EXPECT_LT(drift, 1e-9);
  EXPECT_GT(turned, 0.05) << "the flight must turn the vehicles";
}

/// Returns the largest distance between the positions of two flights with 1 and 4 substeps.
double substeps_matter_m(const Model& model, const Task& task, int vehicles, double end_s) {
  std::vector<double> paths[2];
  for (const int substeps : {1, 4}) {
    Swarm swarm(model, vehicles);
    SampledFlightOptions options = exact();
    options.substeps = substeps;
    SampledFlight loop(swarm, parsed_gains(), task, options);
    std::vector<double>& path = paths[substeps == 1 ? 0 : 1];
    while (loop.time_s() < end_s - 1e-9) {
      loop.step();
      for (int i = 0; i < vehicles; ++i) {
        EXPECT_FALSE(loop.is_saturated(i)) << loop.time_s() << " s";
        for (int axis = 0; axis < 3; ++axis) path.push_back(loop.state()[i * kVehicleStateSize + axis]);
      }
    }
  }
  double largest = 0;
  for (std::size_t k = 0; k < paths[0].size(); ++k)
    largest = std::max(largest, std::abs(paths[0][k] - paths[1][k]));
  return largest;
}

/// One vehicle descends past another that hovers, through the heights at which wakes bend; a third is far away.
class SinksPast : public Task {
 public:
  Setpoint at(int vehicle, double time_s) const override {
    Setpoint to;
    to.p_W_m = {vehicle == 2 ? 10.0 : 0.03 * vehicle, 0, vehicle == 2 ? 1 : 0.6};
    if (vehicle == 1) {
      to.p_W_m.z() += 0.25 * std::cos(3 * time_s);
      to.v_W_m_s.z() = -0.75 * std::sin(3 * time_s);
      to.a_W_m_s2.z() = -2.25 * std::cos(3 * time_s);
    }
    return to;
  }
  double duration_s() const override { return 3; }
};

TEST(SampledFlight, OneAndFourSubstepsAgree) {
  const Model model =
      with_effects({{"downwash", {}}, {"motor_lag", {}}, {"drag_linear", {{"drag_N_s_m", 0.013}}}});
  const struct {
    const char* what;
    std::unique_ptr<Task> task;
    int vehicles;
  } flights[] = {{"swap", make_task("swap", {2, 9, 0}), 2},
                 {"random walk", make_task("random-walk", {2, 6, 0}), 2},
                 {"random walk of five", make_task("random-walk", {5, 3, 0}), 5},
                 {"sinks past", std::make_unique<SinksPast>(), 3}};
  for (const auto& [what, task, vehicles] : flights) {
    SCOPED_TRACE(what);
    const double apart_m = substeps_matter_m(model, *task, vehicles, task->duration_s());
    EXPECT_LT(apart_m, 1e-9);
    EXPECT_GT(apart_m, 0) << "the two must differ for the test to say something";
  }
}

/// One vehicle of a task, flown alone.
class OneOf : public Task {
 public:
  OneOf(const Task& task, int vehicle) : task_(task), vehicle_(vehicle) {}
  Setpoint at(int, double time_s) const override { return task_.at(vehicle_, time_s); }
  double duration_s() const override { return task_.duration_s(); }

 private:
  const Task& task_;
  const int vehicle_;
};

TEST(SampledFlight, StepsThatAreCutForOthersLeaveTheBitsOfAVehicleThatNoneReaches) {
  const Model model = with_effects({{"downwash", {}}, {"motor_lag", {}}});
  const SinksPast task;
  Swarm three(model, 3), one(model, 1);
  SampledFlight together(three, parsed_gains(), task, {});
  const OneOf own(task, 2);
  SampledFlight alone(one, parsed_gains(), own, {});
  for (int k = 0; k < 1500; ++k) {
    together.step();
    alone.step();
    for (int c = 0; c < kVehicleStateSize; ++c) {
      ASSERT_EQ(alone.state()[c], together.state()[2 * kVehicleStateSize + c]) << k << ", component " << c;
    }
  }
}

TEST(SampledFlight, AVehicleFliesTheSameBitsAloneAndAmongOthers) {
  // Several vehicles share SIMD registers, in the controllers (Lanes) and in the plant (RigidBodies); each batch must
  // be bitwise identical to single vehicles. Gains this high drive the thrust of some vehicles to its limit.
  for (const int vehicles : {2, 3, 5, 8, 11}) {
    for (const char* const law : {"lee", "robust"}) {
      Model weak = with_effects({{"drag_linear", {{"drag_N_s_m", 0.013}}}, {"motor_lag", {}}});
      weak.mass_kg *= 2.4;
      Model strong = with_effects({{"motor_lag", {}}});
      const Gains given = parse_gains(
          "schema = \"swarmcert/gains/1\"\n[position]\nKp = [20, 20, 40]\nKd = [10, 10, 9]\nKi = [3, 3, "
          "10]\nrate_hz = 100\n[attitude]\nlaw = \"" +
              std::string(law) + "\"\n",
          "gains.toml");
      std::vector<int> kind_of;
      for (int i = 0; i < vehicles; ++i) kind_of.push_back(i % 4 == 3 ? 1 : 0);
      const auto task = make_task("random-walk", {vehicles, 6, 3});
      Swarm swarm({weak, strong}, kind_of);
      SampledFlight together(swarm, given, *task, {});
      int mixed = 0;
      std::vector<std::vector<double>> states;
      while (together.time_s() < 6) {
        together.step();
        int saturated = 0;
        for (int i = 0; i < vehicles; ++i) saturated += together.record(i).saturated ? 1 : 0;
        mixed += saturated > 0 && saturated < vehicles ? 1 : 0;
        if (together.period() % 100 == 0) {
          states.emplace_back(together.state(), together.state() + swarm.state_size());
        }
      }
      if (vehicles > 3) {
        EXPECT_GT(mixed, 0) << "some must reach the limit while others do not";
      }
      for (int i = 0; i < vehicles; ++i) {
        Swarm single({weak, strong}, {kind_of[static_cast<std::size_t>(i)]});
        const OneOf own(*task, i);
        SampledFlight alone(single, given, own, {});
        for (const std::vector<double>& state : states) {
          for (int k = 0; k < 100; ++k) alone.step();
          for (int c = 0; c < kVehicleStateSize; ++c) {
            ASSERT_EQ(alone.state()[c], state[static_cast<std::size_t>(i * kVehicleStateSize + c)])
                << vehicles << " vehicles, " << law << ", vehicle " << i << ", component " << c << ", "
                << alone.time_s() << " s";
          }
        }
      }
    }
  }
}

TEST(SampledFlight, HoversWhereItShouldAndFloatFliesLikeDouble) {
  for (const bool flies_float : {true, false}) {
    Swarm swarm(tests::small_vehicle(), 2);
    const auto task = make_task("hover", {2, 5, 0});
    SampledFlightOptions options;
    options.flies_float = flies_float;
    SampledFlight loop(swarm, parsed_gains(), *task, options);
    while (loop.time_s() < 5) loop.step();
    for (int i = 0; i < 2; ++i) {
      const Eigen::Map<const Eigen::Vector3d> p(loop.state() + i * kVehicleStateSize);
      EXPECT_LT((p - task->at(i, 5).p_W_m).norm(), 1e-5) << flies_float;
      EXPECT_EQ(loop.record(i).faults, 0);
    }
  }
}

TEST(SampledFlight, SteadyForceIsCancelledByTheIntegralUpToItsClamp) {
  // Reference: residual max(0, |f| / m - Ki I_lim) / Kp for f = 9 gf = 0.0883 N: 0.1597 m.
  Swarm swarm(with_effects({{"constant_force", {{"force_z_N", -0.0883}}}}), 1);
  const auto task = make_task("hover", {1, 40, 0});
  SampledFlight loop(
      swarm,
      parsed_gains(
          "Kp = [20, 20, 10]\nKd = [10, 10, 5]\nKi = [3, 3, 10]\nintegrator_limit = [0.1, 0.1, 0.1]\n"),
      *task, exact());
  while (loop.time_s() < 40) loop.step();
  EXPECT_NEAR(0.6 - loop.state()[2], (0.0883 / 0.034 - 10 * 0.1) / 10, 1e-6);
}

TEST(SampledFlight, ADelayOfOneAndAHalfPeriodsHoldsCommandsThatLong) {
  Swarm swarm(with_effects({{"delay", {{"delay_s", 0.003}}}}), 1);
  const auto task = make_task("circle", {1, 20, 0});
  SampledFlight loop(swarm, parsed_gains(), *task, exact());
  std::vector<double> commands;
  for (int k = 0; k < 2000; ++k) {
    loop.step();
    commands.push_back(loop.record(0).rotor_N[0]);
    // The command that acts at the end of period k is that of the previous period.
    if (k > 3) {
      EXPECT_EQ(loop.input(0).rotor_command_N[0], commands[static_cast<std::size_t>(k - 1)]);
    }
  }
}

TEST(SampledFlight, MotorLagAddsWhatItsColumnSays) {
  // The defining property of effects with a memory: applied thrust minus command = gain times the stream's column.
  Swarm swarm(with_effects({{"motor_lag", {{"gain", 0.8}, {"tau_s", 0.05}}}}), 1);
  const auto task = make_task("takeoff", {1, 12, 0});
  SampledFlight loop(swarm, parsed_gains(), *task, exact());
  // The rotors see a staircase; the stream is exact for linear signals between samples, so it gets both ends of each
  // step.
  const auto lag = make_effect(swarm.model(0).effects[0], {"small", {"small"}, ""});
  const double tau_s = 0.05;
  const auto stream = lag->stream(&tau_s);
  double largest = 0;
  Instant command;
  for (int k = 0; k < 3000; ++k) {
    loop.step();
    VehicleInput input = loop.input(0);
    double thrust_N = 0;
    for (const double f : input.rotor_command_N) thrust_N += f;
    Wrench column;
    command.thrust_N = thrust_N;
    command.time_s = (k + 1e-9) * loop.period_s();
    stream->advance(command, &column);
    command.time_s = (k + 1) * loop.period_s();
    stream->advance(command, &column);
    const double applied_N = swarm.instant(0, loop.time_s(), loop.state(), input).thrust_N;
    if (k == 0) continue;
    EXPECT_NEAR(applied_N - thrust_N, 0.8 * column.force_W_N.z(), 1e-6 * 0.33) << k;
    largest = std::max(largest, std::abs(applied_N - thrust_N));
  }
  EXPECT_GT(largest, 0.01);
}

TEST(SampledFlight, LinearConvolutionPredictsTheSwap) {
  // An independent program: e = h' * f_a predicts the unsaturated swap to 0.5 %. 2 vehicles, effective Ki 2, tau
  // 1/17.4, no noise: simulation 0.0893 m, convolution 0.0896 m.
  Swarm swarm(with_effects({{"downwash", {{"norm_exponent", 1.2}}}, {"motor_lag", {{"tau_s", 1 / 17.4}}}}),
              2);
  const auto task = make_task("swap", {2, 27, 0});
  SampledFlight loop(
      swarm,
      parsed_gains("Kp = [20, 20, 10]\nKd = [10, 10, 5]\nKi = [3, 3, 10]\nintegrator_limit = [0.1, 0.1, "
                   "0.1]\nrate_hz = 100\nintegrator_step_s = 0.002\n"),
      *task, exact());
  // m Delta e = s (tau s + 1) f, Delta = (tau s + 1) s^3 + Kd s^2 + Kp s + Ki: the states of its controllable form.
  const double tau = 1 / 17.4, m = 0.034, Kp = 10, Kd = 5, Ki = 2;
  double z[4] = {0, 0, 0, 0};
  const auto derivative = [&](const double* x, double f, double* dx) {
    dx[0] = x[1];
    dx[1] = x[2];
    dx[2] = x[3];
    dx[3] = (f / m - Ki * x[0] - Kp * x[1] - Kd * x[2] - x[3]) / tau;
  };
  double worst_simulated = 0, worst_linear = 0;
  std::vector<VehicleInput> inputs(2);
  while (loop.time_s() < 27) {
    for (int i = 0; i < 2; ++i) inputs[static_cast<std::size_t>(i)] = loop.input(i);
    const double f = swarm.effects_on(0, loop.time_s(), loop.state(), inputs[0]).force_W_N.z();
    loop.step();
    const double h = loop.period_s();
    double k1[4], k2[4], k3[4], k4[4], x[4];
    derivative(z, f, k1);
    for (int i = 0; i < 4; ++i) x[i] = z[i] + h / 2 * k1[i];
    derivative(x, f, k2);
    for (int i = 0; i < 4; ++i) x[i] = z[i] + h / 2 * k2[i];
    derivative(x, f, k3);
    for (int i = 0; i < 4; ++i) x[i] = z[i] + h * k3[i];
    derivative(x, f, k4);
    for (int i = 0; i < 4; ++i) z[i] += h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]);
    worst_linear = std::max(worst_linear, std::abs(z[1] + tau * z[2]));
    worst_simulated = std::max(worst_simulated, std::abs(loop.state()[2] - 0.6));
    ASSERT_FALSE(loop.record(0).saturated);
  }
  EXPECT_NEAR(worst_simulated, 0.0893, 0.002);
  EXPECT_NEAR(worst_linear, worst_simulated, 0.02 * worst_simulated);
}

TEST(SampledFlight, PredictedForceIsAStaircaseThatComesLate) {
  Gains slow = parsed_gains();
  slow.network_rate_hz = 50;
  slow.network_latency_s = 0.03;
  const auto network = files::load_network({{}, tests::source_path("nn/networks/demo/network.toml"), "", ""});
  Swarm swarm(with_effects({{"downwash", {}}}), 2);
  const auto task = make_task("swap", {2, 9, 0});
  SampledFlight loop(swarm, slow, *task, exact(), &network);
  std::vector<double> predictions;
  int changes = 0;
  for (int k = 0; k < 4500; ++k) {
    loop.step();
    predictions.push_back(loop.record(0).prediction_N);
    if (k > 0 && predictions[static_cast<std::size_t>(k)] != predictions[static_cast<std::size_t>(k - 1)]) {
      EXPECT_EQ((k - 15) % 10, 0) << "every 20 ms, 30 ms late";
      ++changes;
    }
  }
  EXPECT_EQ(predictions[10], 0);
  EXPECT_GT(changes, 200);
}

TEST(SampledFlight, ANeighbourThatFallsSilentFadesOutWithin500ms) {
  // A network whose output depends on the neighbours only. If all positions are lost, the prediction is that of an
  // empty set; if none is lost, it is another; other losses and delays never give a third.
  const auto network = files::load_network({{}, tests::source_path("nn/networks/demo/network.toml"), "", ""});
  const auto predictions = [&](const RadioOptions& radio, std::uint64_t seed) {
    Swarm swarm(with_effects({{"downwash", {}}}), 2);
    const auto task = make_task("swap", {2, 9, 0});
    SampledFlightOptions options = exact();
    options.radio = radio;
    options.seed = seed;
    SampledFlight loop(swarm, parsed_gains(), *task, options, &network);
    std::vector<double> result;
    while (loop.time_s() < 6) {
      loop.step();
      result.push_back(loop.record(0).prediction_N);
    }
    return result;
  };
  const auto distance = [](const std::vector<double>& a, const std::vector<double>& b) {
    double largest = 0;
    for (std::size_t k = 0; k < a.size(); ++k) largest = std::max(largest, std::abs(a[k] - b[k]));
    return largest;
  };
  const auto largest = [](const std::vector<double>& a) {
    double result = 0;
    for (const double x : a) result = std::max(result, std::abs(x));
    return result;
  };
  const std::vector<double> all = predictions({0, 0}, 0), half = predictions({0, 0.5}, 0);
  EXPECT_GT(largest(all), 0.02);
  EXPECT_LT(distance(all, half), 0.5 * largest(all)) << "half of the positions are enough";
  EXPECT_GT(distance(all, half), 0);
  EXPECT_LT(largest(predictions({0, 1}, 0)), 0.1 * largest(all)) << "a vehicle that knows of nobody";
  // Positions 0.45 s old still count, with the remaining weight; positions 0.5 s old do not.
  EXPECT_GT(distance(predictions({0.45, 0}, 0), predictions({0, 1}, 0)), 1e-3);
  EXPECT_LT(distance(predictions({0.5, 0}, 0), predictions({0, 1}, 0)), 1e-3);
  // No jump: between two periods of the network (10 ms) a fade of 100 ms changes by a tenth, plus some motion.
  const std::vector<double> rare = predictions({0, 0.97}, 5);
  double jump = 0;
  for (std::size_t k = 1; k < rare.size(); ++k) jump = std::max(jump, std::abs(rare[k] - rare[k - 1]));
  EXPECT_GT(largest(rare), 0.01);
  EXPECT_LT(jump, 0.35 * largest(all));
}

TEST(Simulation, TakesOffFromTheGroundAndLands) {
  Swarm swarm(with_effects({{"ground", {{"amplitude", 0.164}}}}), 1);
  const auto task = make_task("takeoff", {1, 0, 0});
  const Simulation flown = simulate(swarm, parsed_gains(), *task, {});
  EXPECT_FALSE(flown.diverged);
  EXPECT_LT(flown.vehicles[0].error.max_m[2], 0.1);
  EXPECT_GE(flown.vehicles[0].smallest_height_m, 0.05 - 1e-9);
}

TEST(Simulation, SameSeedGivesTheSameLogsAndAnotherSeedOthers) {
  const auto logs = [](std::uint64_t seed) {
    Swarm swarm(with_effects({{"downwash", {}}}), 2);
    const auto task = make_task("random-walk", {2, 3, seed});
    SimulationOptions options;
    options.loop.seed = seed;
    options.loop.noise = true;
    const Simulation flown = simulate(swarm, parsed_gains(), *task, options);
    return to_usd_log(flown.logs[0]) + to_usd_log(flown.logs[1]);
  };
  EXPECT_EQ(logs(1), logs(1));
  EXPECT_NE(logs(1), logs(2));
}

}  // namespace
}  // namespace swarmcert::stability
