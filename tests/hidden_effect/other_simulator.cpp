#include "hidden_effect/other_simulator.h"

#include <fmt/core.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>

#include "stability/simulation/flight_log.h"

namespace swarmcert::tests {
namespace {

using Eigen::Vector3d;

constexpr double kPi = 3.14159265358979323846;
constexpr double kG_m_s2 = 9.81;
constexpr double kNominalMass_kg = 0.034;
constexpr double kStep_s = 1e-3;
constexpr int kControlEvery = 4;
constexpr double kFloor_m = 0.055, kFullCell_V = 4.2;

/// Load-cell map of the small vehicle, gram-force per rotor; see stability/models/crazyflie-small.toml.
double rotor_gf(double p, double v) {
  return 11.093358483549203 - 39.08104165843915 * p - 9.525647087583181 * v + 20.573302305476638 * p * p +
         38.42885066644033 * p * v;
}

/// Inverse of rotor_gf() in p.
double duty_for(double gf, double v) {
  const double a = 20.573302305476638, b = -39.08104165843915 + 38.42885066644033 * v;
  const double c = 11.093358483549203 - 9.525647087583181 * v - gf;
  return std::clamp((-b + std::sqrt(std::max(b * b - 4 * a * c, 0.0))) / (2 * a), 0.0, 1.0);
}

class Noise {
 public:
  explicit Noise(std::uint64_t seed) : generator_(seed) {}
  double bell() { return bell_(generator_); }
  double uniform(double lower, double upper) {
    return lower + (upper - lower) * std::generate_canonical<double, 53>(generator_);
  }

 private:
  std::mt19937_64 generator_;
  std::normal_distribution<double> bell_;
};

/// Sums of sines with random frequencies and phases; the amplitude is at most 1.
struct Wave {
  struct Part {
    double size, omega_rad_s, phase;
  };
  std::vector<Part> parts;

  Wave(Noise& noise, double lowest_hz, double highest_hz) {
    for (const double size : {0.5, 0.3, 0.2})
      parts.push_back({size, 2 * kPi * noise.uniform(lowest_hz, highest_hz), noise.uniform(0, 2 * kPi)});
  }
  /// Returns the value and the first two derivatives.
  std::array<double, 3> at(double t) const {
    std::array<double, 3> sum{};
    for (const Part& part : parts) {
      const double angle = part.omega_rad_s * t + part.phase;
      sum[0] += part.size * std::sin(angle);
      sum[1] += part.size * part.omega_rad_s * std::cos(angle);
      sum[2] -= part.size * part.omega_rad_s * part.omega_rad_s * std::sin(angle);
    }
    return sum;
  }
};

struct Target {
  Vector3d p, v, a;
};

/// The path of one vehicle: each axis has a centre and a few waves. All vehicles stand still for a second and then
/// start together, like the published flights, so that clock offsets can be found.
struct Path {
  struct Part {
    int axis;
    double reach_m;
    Wave wave;
  };
  Vector3d centre;
  std::vector<Part> parts;
  double rise_1_s = 0;  ///< of z, in addition to the waves

  Target at(double t) const {
    const double since = std::max(t - 1, 0.0);
    const bool starts = since < 1;
    const double s = starts ? since * since / 2 : since - 0.5, ds = starts ? since : 1;
    const double dds = starts && since > 0 ? 1 : 0;
    Target target{centre + Vector3d(0, 0, rise_1_s * s), Vector3d(0, 0, rise_1_s * ds),
                  Vector3d(0, 0, rise_1_s * dds)};
    for (const Part& part : parts) {
      const auto w = part.wave.at(s);
      target.p[part.axis] += part.reach_m * w[0];
      target.v[part.axis] += part.reach_m * w[1] * ds;
      target.a[part.axis] += part.reach_m * (w[2] * ds * ds + w[1] * dds);
    }
    return target;
  }
};

std::vector<Path> paths_of(const FlightPlan& plan, Noise& noise) {
  const auto waves = [&](const Vector3d& reach_m, double lowest_hz, double highest_hz) {
    std::vector<Path::Part> parts;
    for (int axis = 0; axis < 3; ++axis)
      parts.push_back({axis, reach_m[axis], Wave(noise, lowest_hz, highest_hz)});
    return parts;
  };
  std::vector<Path> paths;
  for (int i = 0; i < plan.vehicles; ++i) {
    switch (plan.program) {
      case Program::kRich: {
        const double start = noise.uniform(0, 2 * kPi), rise_1_s = noise.uniform(0.9, 1.3);
        paths.push_back({{0, 0, start}, waves({0.7, 0.7, 1}, 0.1, 0.3), rise_1_s});
        if (i == 0) break;
        // Laterally it moves around the first one, so that they pass below and above each other.
        std::vector<Path::Part>& parts = paths.back().parts;
        parts[0].wave = paths[0].parts[0].wave;
        parts[1].wave = paths[0].parts[1].wave;
        for (const int axis : {0, 1}) parts.push_back({axis, 0.35, Wave(noise, 0.1, 0.4)});
        break;
      }
      case Program::kSlow:
        paths.push_back({{0.06 * i, 0, 0.45}, waves({0.35, 0.35, 0.15}, 0.03, 0.08), 0});
        break;
      case Program::kHover:
        paths.push_back({{0.5 * i, 0, 0.5}, waves({0.003, 0.003, 0.003}, 0.02, 0.05), 0});
        break;
    }
  }
  return paths;
}

/// Heights of the rich program: up and down between both limits at varying speeds, so that both are reached. On input z
/// is a wave that keeps rising; on output it is a height.
void fold_height(const FlightPlan& plan, Target& target) {
  if (plan.program != Program::kRich) return;
  constexpr double kHighest_m = 1;
  const double half = 0.5 * (kHighest_m - plan.lowest_m);
  const double angle = target.p.z(), rate = target.v.z(), change = target.a.z();
  target.p.z() = plan.lowest_m + half * (1 - std::cos(angle));
  target.v.z() = half * std::sin(angle) * rate;
  target.a.z() = half * (std::cos(angle) * rate * rate + std::sin(angle) * change);
}

/// A two-pole Butterworth low-pass at 30 Hz, integrated in small steps.
struct Accelerometer {
  Vector3d y = Vector3d::Zero(), dy = Vector3d::Zero();
  bool filled = false;
  Vector3d step(const Vector3d& u) {
    if (!filled) y = u;
    filled = true;
    const double w = 2 * kPi * 30;
    constexpr int kSub = 4;
    for (int k = 0; k < kSub; ++k) {
      const double h = kStep_s / kSub;
      dy += h * (w * w * (u - y) - std::sqrt(2.0) * w * dy);
      y += h * dy;
    }
    return y;
  }
};

struct Vehicle {
  Vector3d p, v = Vector3d::Zero(), integral = Vector3d::Zero(), gust = Vector3d::Zero();
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  Vector3d rates = Vector3d::Zero(), position_error = Vector3d::Zero(), velocity_error = Vector3d::Zero();
  double command_N = 0, stage_N = 0, thrust_N = 0, duty = 0, spent_J = 0, battery_V = 4.15;
  std::vector<double> commands_N;  ///< by step, for the delay
  std::vector<Vector3d> felt;      ///< specific force by step, in the world
  Accelerometer accelerometer;
  std::vector<stability::LogRecord> records;
  double clock_s = 0;
};

Vector3d hidden_force(const Truth& truth, const std::vector<Vehicle>& all, std::size_t i, double time_s) {
  if (!truth.force_N) return Vector3d::Zero();
  Moment now;
  const Vehicle& own = all[i];
  const Eigen::Matrix3d R = own.q.toRotationMatrix();
  now.time_s = time_s;
  now.p_m = own.p;
  now.v_m_s = own.v;
  now.b1 = R.col(0);
  now.b2 = R.col(1);
  now.b3 = R.col(2);
  now.thrust_N = own.thrust_N;
  now.battery_V = own.battery_V;
  for (std::size_t j = 0; j < all.size(); ++j) {
    if (j != i) now.others.push_back({all[j].p - own.p, all[j].v});
  }
  return truth.force_N(now);
}

/// Position control based on an estimator with slowly varying errors: sets the command and returns the desired thrust
/// axis.
Vector3d control(const Craft& craft, Vehicle& vehicle, const Target& target, Noise& noise) {
  const double decay = std::exp(-kControlEvery * kStep_s / 0.02), fresh = std::sqrt(1 - decay * decay);
  for (int axis = 0; axis < 3; ++axis) {
    vehicle.position_error[axis] = decay * vehicle.position_error[axis] + fresh * 2e-4 * noise.bell();
    vehicle.velocity_error[axis] = decay * vehicle.velocity_error[axis] + fresh * 5e-3 * noise.bell();
  }
  const Vector3d ep = target.p - vehicle.p - vehicle.position_error;
  const Vector3d ev = target.v - vehicle.v - vehicle.velocity_error;
  vehicle.integral = (vehicle.integral + kControlEvery * kStep_s * ep).cwiseMax(-0.3).cwiseMin(0.3);
  const Vector3d wanted =
      craft.mass_kg * (target.a + Vector3d(0, 0, kG_m_s2) + 16 * ep + 6 * ev + 5 * vehicle.integral);
  const Vector3d b3 = vehicle.q * Vector3d::UnitZ();
  const double size = craft.mass_kg / kNominalMass_kg;
  vehicle.duty = duty_for(std::clamp(wanted.dot(b3) / size, 0.1, 0.55) / 4 * 1000 / kG_m_s2,
                          vehicle.battery_V / (kFullCell_V * craft.cells));
  return wanted.normalized();
}

stability::LogRecord record(const Vehicle& vehicle, const Target& target, double time_s, Noise& noise) {
  stability::LogRecord log;
  log.tick_us = static_cast<std::uint32_t>(1e6 * (time_s - vehicle.clock_s) + 6000 + 80 * noise.bell());
  Eigen::Quaterniond q = vehicle.q;
  q = q * Eigen::Quaterniond(1, 5e-4 * noise.bell(), 5e-4 * noise.bell(), 5e-4 * noise.bell()).normalized();
  log.quaternion = stability::compress_quaternion(q);
  const Vector3d noise_B = 0.12 * Vector3d(noise.bell(), noise.bell(), noise.bell());
  const Vector3d a = q * (vehicle.accelerometer.y + noise_B);
  auto& kinematics = log.position_mm_velocity_mm_s_acceleration_mm_s2;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto axis = static_cast<int>(i);
    kinematics[i] = stability::milli(vehicle.p[axis] + 2e-4 * noise.bell());
    kinematics[3 + i] = stability::milli(vehicle.v[axis] + 5e-3 * noise.bell());
    kinematics[6 + i] = stability::milli(a[axis]);
    log.rates_mrad_s[i] = stability::milli(vehicle.rates[axis]);
    log.target_mm_mm_s[i] = stability::milli(target.p[axis]);
    log.target_mm_mm_s[3 + i] = stability::milli(target.v[axis]);
  }
  log.thrust_N = static_cast<float>(vehicle.command_N);
  log.motor_N.fill(static_cast<float>(vehicle.command_N / 4));
  log.pwm.fill(static_cast<std::uint32_t>(std::lround(65535 * vehicle.duty)));
  log.battery_mV = static_cast<std::uint16_t>(std::lround(1000 * vehicle.battery_V));
  return log;
}

}  // namespace

std::string model_of(const Craft& craft) {
  const double size = craft.mass_kg / kNominalMass_kg, length = std::cbrt(size);
  const auto each = [&](double gf, int cells) { return gf * size / cells; };
  return fmt::format(
      "schema = \"swarmcert/model/1\"\n\n[vehicle]\nkind = \"small\"\nmass_kg = {}\n"
      "inertia_kg_m2 = [{}, {}, {}]\narm_m = {}\ntorque_per_thrust_m = {}\n"
      "battery_range_V = [{}, {}]\n\n"
      "[vehicle.thrust]\nc00 = {}\nc10 = {}\nc01 = {}\nc20 = {}\nc11 = {}\n",
      craft.mass_kg, 1.6572e-05 * size * length * length, 1.6656e-05 * size * length * length,
      2.9262e-05 * size * length * length, 0.046 * length, 0.00596 * length, 2.5 * craft.cells,
      4.5 * craft.cells, each(11.093358483549203, 1), each(-39.08104165843915, 1),
      each(-9.525647087583181, craft.cells), each(20.573302305476638, 1),
      each(38.42885066644033, craft.cells));
}

void fly(const Truth& truth, const FlightPlan& plan, const std::string& folder, int run) {
  Noise noise(plan.seed * 7919 + 17);
  const std::vector<Path> paths = paths_of(plan, noise);
  const auto target_of = [&](std::size_t i, double t) {
    Target target = paths[i].at(t);
    fold_height(plan, target);
    return target;
  };
  std::vector<Vehicle> vehicles(paths.size());
  std::vector<Vector3d> wanted_axis(paths.size(), Vector3d::UnitZ());
  for (std::size_t i = 0; i < vehicles.size(); ++i) {
    const Target start = target_of(i, 0);
    vehicles[i].p = start.p;
    vehicles[i].v = start.v;
    vehicles[i].command_N = vehicles[i].stage_N = vehicles[i].thrust_N = plan.craft.mass_kg * kG_m_s2;
    vehicles[i].battery_V *= plan.craft.cells;
    vehicles[i].clock_s = noise.uniform(0, 0.02);
  }
  const double mass_kg = plan.craft.mass_kg * truth.mass_factor, cells = plan.craft.cells;
  const double size = plan.craft.mass_kg / kNominalMass_kg;
  const int log_every = static_cast<int>(std::lround(1 / (kStep_s * plan.log_hz)));
  const auto steps = static_cast<int>(plan.duration_s / kStep_s);
  const auto late = [](const auto& past, double delay_s) {
    const auto back = static_cast<std::size_t>(std::lround(delay_s / kStep_s));
    return past[past.size() - 1 - std::min(back, past.size() - 1)];
  };
  for (int k = 0; k < steps; ++k) {
    const double time_s = k * kStep_s;
    std::vector<Vector3d> forces;
    for (std::size_t i = 0; i < vehicles.size(); ++i)
      forces.push_back(hidden_force(truth, vehicles, i, time_s));
    for (std::size_t i = 0; i < vehicles.size(); ++i) {
      Vehicle& it = vehicles[i];
      const Target target = target_of(i, time_s);
      if (k % kControlEvery == 0) wanted_axis[i] = control(plan.craft, it, target, noise);
      // A cell with internal resistance that is empty after a few minutes.
      it.spent_J += it.command_N * kStep_s;
      it.battery_V = cells * (4.15 - (0.012 * it.spent_J + 0.35 * it.command_N) / size);
      const double mapped_N =
          size * 4 * rotor_gf(it.duty, it.battery_V / (kFullCell_V * cells)) * kG_m_s2 / 1000;
      it.command_N = mapped_N;
      it.commands_N.push_back(mapped_N * truth.thrust_factor *
                              (1 + truth.battery_1_V * (it.battery_V - kFullCell_V * cells)));
      const double command_N = late(it.commands_N, truth.command_delay_s);
      const auto follow = [](double& x, double u, double tau_s) {
        x += tau_s > 0 ? (1 - std::exp(-kStep_s / tau_s)) * (u - x) : u - x;
      };
      follow(it.stage_N, command_N, truth.motor_lag_s);
      follow(it.thrust_N, it.stage_N, truth.motor_lag2_s);
      if (truth.gust_N > 0) {
        const double decay = std::exp(-kStep_s / truth.gust_time_s);
        for (int axis = 0; axis < 3; ++axis)
          it.gust[axis] = decay * it.gust[axis] + std::sqrt(1 - decay * decay) * truth.gust_N * noise.bell();
      }
      const Vector3d b3 = it.q * Vector3d::UnitZ();
      const Vector3d specific = (it.thrust_N * b3 + forces[i] + it.gust) / mass_kg;
      it.v += kStep_s * (specific - Vector3d(0, 0, kG_m_s2));
      it.p += kStep_s * it.v;
      if (it.p.z() < kFloor_m) {
        it.p.z() = kFloor_m;
        it.v.z() = std::max(it.v.z(), 0.0);
      }
      // Attitude: rates that rotate b3 to its desired direction and hold the heading, with a lag of 25 ms.
      const Vector3d axis_W = b3.cross(wanted_axis[i]);
      Vector3d rates = 12 * (it.q.conjugate() * axis_W);
      rates.z() = -4 * std::atan2(it.q.toRotationMatrix()(1, 0), it.q.toRotationMatrix()(0, 0));
      it.rates += kStep_s / 0.025 * (rates - it.rates);
      const Vector3d half = 0.5 * kStep_s * it.rates;
      it.q = (it.q * Eigen::Quaterniond(1, half.x(), half.y(), half.z())).normalized();
      it.felt.push_back(specific);
      it.accelerometer.step(it.q.conjugate() * late(it.felt, truth.sensor_delay_s) + truth.imu_bias_m_s2);
      if (k % log_every == 0 && time_s > it.clock_s + 0.01)
        it.records.push_back(record(it, target, time_s, noise));
    }
  }
  std::filesystem::create_directories(folder);
  for (std::size_t i = 0; i < vehicles.size(); ++i) {
    std::ofstream(fmt::format("{}/cf{}_{:02}", folder, i + 1, run), std::ios::binary)
        << stability::to_usd_log(vehicles[i].records);
  }
}

}  // namespace swarmcert::tests
