// Speed of the closed loops compared with a plain Boost odeint loop on the same equations.
//   cmake --build --preset release --target benchmark_closed_loops &&
//   build/release/tests/benchmarks/benchmark_closed_loops
#include <fmt/core.h>

#include <boost/numeric/odeint.hpp>
#include <cmath>
#include <ctime>
#include <functional>
#include <vector>

#include "data.h"
#include "stability/simulation/continuous_flight.h"
#include "stability/simulation/pilot.h"
#include "stability/simulation/sampled_flight.h"

namespace {

using namespace swarmcert::stability;

/// Returns the processor time, which is less disturbed by other programs than wall-clock time.
double seconds(const std::function<void()>& work) {
  const std::clock_t start = std::clock();
  work();
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

/// Returns the best speed of twenty runs, in simulated seconds per second.
double speed(double simulated_s, const std::function<void()>& work) {
  double best = 1e300;
  for (int i = 0; i < 20; ++i) best = std::min(best, seconds(work));
  return simulated_s / best;
}

/// Returns the vehicle, which is read only once so that reading is not timed.
const Model& vehicle() {
  static const Model read = [] {
    Model model = read_model(swarmcert::tests::source_path("stability/models/crazyflie-small.toml"));
    EffectSpec downwash;
    downwash.name = "downwash";
    model.effects.push_back(downwash);
    return model;
  }();
  return read;
}

const Gains& gains() {
  static const Gains read = parse_gains(
      "schema = \"swarmcert/gains/1\"\n[position]\nKp = [20, 20, 10]\nKd = [10, 10, 5]\nKi = [3, 3, "
      "10]\nrate_hz = 100\n[attitude]\nlaw = \"lee\"\n",
      "gains.toml");
  return read;
}

const Gains& continuous_gains() {
  static const Gains read = [] {
    Gains result = gains();
    result.rate_hz = 0;
    return result;
  }();
  return read;
}

/// A baseline without this project: the plant of the sampled loop under odeint's fixed-step RK4, with every pair of
/// vehicles in every evaluation and the same flight code in the same float type.
double odeint_sampled(int vehicles, double end_s) {
  return speed(end_s, [=] {
    using State = std::vector<double>;
    Swarm swarm(vehicle(), vehicles);
    const auto task = make_task("circle", {vehicles, end_s, 0});
    const Pilot<float> pilot(
        [] {
          Gains g = gains();
          g.integrator_step_s = 0.01;
          return g;
        }(),
        vehicle(), 0.002);
    std::vector<swarmcert::controller::FlightMemory<float>> memory(static_cast<std::size_t>(vehicles));
    std::vector<VehicleInput> inputs(static_cast<std::size_t>(vehicles));
    State x(static_cast<std::size_t>(swarm.state_size()));
    for (int i = 0; i < vehicles; ++i) {
      set_hover(swarm.model(i), task->at(i, 0).p_W_m, {0, 0, 0},
                &x[static_cast<std::size_t>(i) * kVehicleStateSize]);
    }
    boost::numeric::odeint::runge_kutta4<State> stepper;
    const auto f = [&](const State& y, State& dy, double t) {
      swarm.derivative(t, y.data(), inputs.data(), dy.data());
    };
    const auto narrow = [](const double* v) {
      return swarmcert::controller::Vector3<float>{static_cast<float>(v[0]), static_cast<float>(v[1]),
                                                   static_cast<float>(v[2])};
    };
    for (int k = 0; k * 0.002 < end_s; ++k) {
      const auto now_ms = static_cast<std::uint32_t>(2 * k);
      for (int i = 0; i < vehicles; ++i) {
        const double* const s = &x[static_cast<std::size_t>(i) * kVehicleStateSize];
        const Setpoint to = task->at(i, 0.002 * k);
        Eigen::Matrix3d R;
        rotation_of(s + kQuaternion, &R);
        swarmcert::controller::Measured<float> measured;
        measured.position_W_m = narrow(s);
        measured.velocity_W_m_s = narrow(s + 3);
        const Eigen::Matrix3d Rt = R.transpose();  // column-major: rows of R
        measured.attitude = {{narrow(Rt.data()), narrow(Rt.data() + 3), narrow(Rt.data() + 6)},
                             narrow(s + kOmega)};
        measured.position_stamp_ms = measured.attitude_stamp_ms = now_ms;
        measured.battery_V = 4.1F;
        const auto command = pilot.step(
            memory[static_cast<std::size_t>(i)], measured,
            {narrow(to.p_W_m.data()), narrow(to.v_W_m_s.data()), narrow(to.a_W_m_s2.data()), {}, {}, {}},
            0.0F, now_ms, k % 5 == 0);
        for (int r = 0; r < kNumRotors; ++r) {
          inputs[static_cast<std::size_t>(i)].rotor_command_N[r] =
              static_cast<double>(command.mixed.forces.at_N[r]);
        }
      }
      stepper.do_step(f, x, 0.002 * k, 0.002);
    }
  });
}

double sampled(const char* name, int vehicles, double end_s) {
  return speed(end_s, [=] {
    Swarm swarm(vehicle(), vehicles);
    const auto task = make_task(name, {vehicles, end_s, 0});
    SampledFlight flight(swarm, gains(), *task, {});
    while (flight.time_s() < end_s) flight.step();
  });
}

double continuous(int vehicles, double end_s, OdeMethod method, long* evaluations) {
  return speed(end_s, [=] {
    Swarm swarm(vehicle(), vehicles);
    const auto task = make_task("circle", {vehicles, end_s, 0});
    ContinuousFlightOptions options;
    options.method = method;
    options.relative = 1e-6;
    options.absolute_scale = 100;
    ContinuousFlight flight(swarm, continuous_gains(), *task, options);
    flight.advance(end_s);
    *evaluations = flight.evaluations();
  });
}

}  // namespace

int main() {
  fmt::print("Simulated seconds per second, one core, best of twenty; downwash between all\n");
  fmt::print("{:<34} {:>10} {:>10} {:>10}\n", "", "1", "5", "16");
  for (const char* const task : {"circle", "swap"}) {
    fmt::print("{:<34} {:>10.0f} {:>10.0f} {:>10.0f}\n", fmt::format("sampled, 500 Hz, RK4, {}", task),
               sampled(task, 1, 40), sampled(task, 5, 40), sampled(task, 16, 20));
  }
  fmt::print("{:<34} {:>10.0f} {:>10.0f} {:>10.0f}\n", "circle by a plain odeint loop", odeint_sampled(1, 40),
             odeint_sampled(5, 40), odeint_sampled(16, 20));
  const std::pair<const char*, OdeMethod> methods[] = {
      {"continuous, CVODE BDF 1e-6", OdeMethod::kBdf},
      {"continuous, CVODE Adams 1e-6", OdeMethod::kAdams},
      {"continuous, ARKODE DP5 1e-6", OdeMethod::kRungeKutta}};
  for (const auto& [name, method] : methods) {
    fmt::print("{:<34}", name);
    for (const int vehicles : {1, 5, 16}) {
      long evaluations = 0;
      const double s = continuous(vehicles, 20, method, &evaluations);
      fmt::print(" {:>10.0f}", s);
      if (vehicles == 1) fmt::print(" ({} evaluations)", evaluations);
    }
    fmt::print("\n");
  }
}
