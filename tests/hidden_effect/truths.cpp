#include "hidden_effect/truths.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace swarmcert::tests {
namespace {

using Eigen::Vector3d;

/// Sanchez-Cuevas, Heredia and Ollero 2017: four rotors near the ground, R = 23.5 mm, arms of 46 mm.
Vector3d multirotor_ground(const Moment& now, double radius_m) {
  const double R = radius_m, d = 2 * 0.0325, b = 0.092, kBody = 2;
  const double z = std::max(now.p_m.z() - 0.02, 0.03);
  const auto power = [](double x) { return x * std::sqrt(x); };
  const double loss = (R / (4 * z)) * (R / (4 * z)) + R * R * z / power(d * d + 4 * z * z) +
                      R * R / 2 * z / power(2 * d * d + 4 * z * z) +
                      2 * R * R * z * kBody / power(b * b + 4 * z * z);
  return now.thrust_N * (1 / (1 - loss) - 1) * now.b3;
}

/// Gain at the floor and a dip above it, as in published flights.
Vector3d ground_with_dip(const Moment& now) {
  const double h = now.p_m.z() - 0.06;
  const double bump = (now.p_m.z() - 0.19) / 0.04;
  return now.thrust_N * (0.2 * std::exp(-h / 0.04) - 0.01 * std::exp(-bump * bump / 2)) * now.b3;
}

/// Each rotor of the upper vehicle has a separate jet.
Vector3d jet_per_rotor(const Moment& now) {
  double sum_N = 0;
  for (const Moment::Other& other : now.others) {
    const double dz = other.dp_m.z();
    if (dz < 0.05) continue;
    const double spread_m = 0.03 + 0.07 * dz;
    for (const double x : {-0.0325, 0.0325}) {
      for (const double y : {-0.0325, 0.0325}) {
        const double r2 = std::pow(other.dp_m.x() + x, 2) + std::pow(other.dp_m.y() + y, 2);
        sum_N += 0.033 * std::min((dz - 0.05) / 0.07, 1.0) * std::exp(-r2 / (2 * spread_m * spread_m));
      }
    }
  }
  return {0, 0, -sum_N};
}

Vector3d jet_lorentzian(const Moment& now) {
  double sum_N = 0;
  for (const Moment::Other& other : now.others) {
    const double dz = other.dp_m.z();
    if (dz < 0.05) continue;
    sum_N +=
        0.09 * std::min((dz - 0.05) / 0.07, 1.0) / (1 + other.dp_m.head<2>().squaredNorm() / (0.08 * 0.08));
  }
  return {0, 0, -sum_N};
}

/// The library's form with its default spreads: f_z = -A (0.3 / dz)^0.44 exp(-r^2 / (2 (s0 + s1 dz)^2)).
Vector3d jet_gaussian(const Moment& now, double amplitude_N) {
  double sum_N = 0;
  for (const Moment::Other& other : now.others) {
    const double dz = other.dp_m.z();
    if (dz <= 0.05) continue;
    const double height_m = std::max(dz, 0.12);
    const double spread_m = 0.026 + 0.082 * height_m;
    const double x = std::min((dz - 0.05) / 0.07, 1.0);
    sum_N += amplitude_N * x * x * (3 - 2 * x) * std::pow(0.3 / height_m, 0.44) *
             std::exp(-other.dp_m.head<2>().squaredNorm() / (2 * spread_m * spread_m));
  }
  return {0, 0, -sum_N};
}

/// Wide rotors below a ceiling at 1.25 m: 1 / (1 - a (R / gap)^2), the form measured by Sanchez-Cuevas. With steeper
/// ones the ceiling effect overpowers the controller.
Vector3d rational_ceiling(const Moment& now) {
  const double gap_m = std::max(1.25 - now.p_m.z(), 0.2);
  return now.thrust_N * (1 / (1 - 0.8 * std::pow(0.1 / gap_m, 2)) - 1) * now.b3;
}

Hidden force(const std::string& name, std::function<Vector3d(const Moment&)> f,
             std::set<std::string> answers) {
  Hidden hidden;
  hidden.name = name;
  hidden.truth.force_N = std::move(f);
  hidden.answers = std::move(answers);
  return hidden;
}

Hidden valued(Hidden hidden, const std::string& parameter, double value, double tolerance = 0.1) {
  hidden.parameter = parameter;
  hidden.value = value;
  hidden.tolerance = tolerance;
  return hidden;
}

Hidden signals(const std::string& name, const std::function<void(Truth&)>& change,
               std::set<std::string> answers) {
  Hidden hidden;
  hidden.name = name;
  change(hidden.truth);
  hidden.answers = std::move(answers);
  return hidden;
}

}  // namespace

Truth together(const Truth& a, const Truth& b) {
  Truth both = a;
  both.mass_factor *= b.mass_factor;
  both.thrust_factor *= b.thrust_factor;
  both.battery_1_V += b.battery_1_V;
  both.motor_lag_s = std::max(a.motor_lag_s, b.motor_lag_s);
  both.motor_lag2_s = std::max(a.motor_lag2_s, b.motor_lag2_s);
  both.command_delay_s += b.command_delay_s;
  both.sensor_delay_s += b.sensor_delay_s;
  both.imu_bias_m_s2 += b.imu_bias_m_s2;
  both.gust_N = std::hypot(a.gust_N, b.gust_N);
  if (a.force_N && b.force_N)
    both.force_N = [f = a.force_N, g = b.force_N](const Moment& now) { return Vector3d(f(now) + g(now)); };
  else if (b.force_N)
    both.force_N = b.force_N;
  return both;
}

std::vector<Hidden> single_effects() {
  const std::set<std::string> constant = {"constant_force"};
  std::vector<Hidden> all = {
      // A mass that is too large by a twentieth looks like a twentieth less thrust.
      valued(signals("mass", [](Truth& t) { t.mass_factor = 1.05; }, {"thrust_ratio"}), "ratio",
             1 / 1.05 - 1),
      valued(signals("thrust", [](Truth& t) { t.thrust_factor = 1.08; }, {"thrust_ratio"}), "ratio", 0.08),
      valued(signals("battery", [](Truth& t) { t.battery_1_V = 0.25; }, {"battery"}), "sensitivity_1_V",
             0.25),
      valued(signals("motor lag", [](Truth& t) { t.motor_lag_s = kUsualLag_s; }, {"motor_lag"}), "tau_s",
             kUsualLag_s),
      signals("motor of second order",
              [](Truth& t) {
                t.motor_lag_s = 0.045;
                t.motor_lag2_s = 0.02;
              },
              {"motor_lag"}),
      valued(signals("command delay", [](Truth& t) { t.command_delay_s = 0.03; }, {"delay"}), "delay_s",
             0.03),
      valued(signals("sensor delay", [](Truth& t) { t.sensor_delay_s = 0.03; }, {"sensor_delay"}), "delay_s",
             0.03),
      valued(force("linear drag", [](const Moment& now) { return Vector3d(-0.02 * now.v_m_s); },
                   {"drag_linear"}),
             "drag_N_s_m", 0.02),
      valued(force("quadratic drag",
                   [](const Moment& now) { return Vector3d(-0.03 * now.v_m_s.norm() * now.v_m_s); },
                   {"drag_quadratic"}),
             "drag_N_s2_m2", 0.03),
      valued(force("rotor drag",
                   [](const Moment& now) {
                     const Vector3d in_plane = now.v_m_s - now.b3 * now.b3.dot(now.v_m_s);
                     return Vector3d(-0.02 * now.thrust_N / (0.034 * 9.81) * in_plane);
                   },
                   {"drag_rotor"}),
             "drag_N_s_m", 0.02),
      valued(force("inflow",
                   [](const Moment& now) {
                     return Vector3d(-0.06 * now.thrust_N * now.b3.dot(now.v_m_s) * now.b3);
                   },
                   {"inflow"}),
             "loss_s_m", 0.06),
      force("multirotor ground", [](const Moment& now) { return multirotor_ground(now, 0.0235); },
            {"ground"}),
      force("ground with a dip", ground_with_dip, {"ground"}),
      force("rational ceiling", rational_ceiling, {"ceiling"}),
      force("jet of each rotor", jet_per_rotor, {"downwash"}),
      force("Lorentzian jet", jet_lorentzian, {"downwash"}),
      valued(force("Gaussian jet", [](const Moment& now) { return jet_gaussian(now, 0.09); }, {"downwash"}),
             "amplitude_N", 0.09, 0.15),
      valued(force("lift of an upper jet",
                   [](const Moment& now) {
                     double sum_N = 0;
                     for (const Moment::Other& other : now.others) {
                       const double below_m = -other.dp_m.z();
                       if (below_m > 0.05)
                         sum_N += 0.03 * std::sqrt(0.3 / std::max(below_m, 0.12)) *
                                  std::exp(-other.dp_m.head<2>().squaredNorm() / (2 * 0.1 * 0.1));
                     }
                     return Vector3d(0, 0, sum_N);
                   },
                   {"upper_lift"}),
             "amplitude_N", 0.03, 0.15),
      valued(force(
                 "wind", [](const Moment&) { return Vector3d(0.02, 0.01, 0); }, constant),
             "force_x_N", 0.02),
      signals(
          "IMU bias",
          [](Truth& t) {
            t.imu_bias_m_s2 = {0.2, 0, 0};
          },
          constant),
      force(
          "tilted thrust axis", [](const Moment& now) { return Vector3d(now.thrust_N * 0.019 * now.b1); },
          constant),
  };
  for (Hidden& hidden : all) {
    if (hidden.name.find("jet") != std::string::npos) hidden.vehicles = 2;
  }
  return all;
}

std::vector<Hidden> foreign_forces() {
  Hidden gust = signals("gust", [](Truth& t) { t.gust_N = 0.02; }, {});
  Hidden strong = signals("strong gust", [](Truth& t) { t.gust_N = 0.04; }, {});
  strong.truth.gust_time_s = 1;
  Hidden waves = force("waves in space",
                       [](const Moment& now) {
                         return Vector3d(0, 0, 0.04 * std::sin(9 * now.p_m.x()) * std::cos(7 * now.p_m.y()));
                       },
                       {});
  Hidden spring =
      force("a spring to one place",
            [](const Moment& now) {
              const Vector3d away = now.p_m - Vector3d(0.3, 0, 0.5);
              return Vector3d(-0.06 * away.norm() * std::sin(6 * away.norm()) * away.normalized());
            },
            {});
  std::vector<Hidden> all = {gust, strong, waves, spring};
  for (Hidden& hidden : all) hidden.is_foreign = true;
  return all;
}

Hidden named(const std::string& name) {
  const std::vector<Hidden> all = single_effects();
  const auto found = std::find_if(all.begin(), all.end(), [&](const Hidden& h) { return h.name == name; });
  if (found == all.end()) throw std::logic_error("no effect " + name);
  return *found;
}

std::vector<std::vector<Hidden>> disturbed() {
  Hidden gust = foreign_forces()[0];
  gust.truth.gust_N = 0.012;
  std::vector<std::vector<Hidden>> result;
  for (const char* name : {"mass", "motor lag", "linear drag", "ground with a dip", "Gaussian jet", "wind"})
    result.push_back({named(name), gust});
  return result;
}

std::vector<std::vector<Hidden>> pairs() {
  std::vector<std::vector<Hidden>> result;
  const std::pair<const char*, const char*> wanted[] = {{"mass", "linear drag"},
                                                        {"motor lag", "ground with a dip"},
                                                        {"battery", "rotor drag"},
                                                        {"Gaussian jet", "motor lag"},
                                                        {"Lorentzian jet", "mass"},
                                                        {"wind", "linear drag"},
                                                        {"multirotor ground", "thrust"},
                                                        {"quadratic drag", "motor lag"},
                                                        {"ground with a dip", "jet of each rotor"},
                                                        {"IMU bias", "mass"},
                                                        {"command delay", "linear drag"},
                                                        {"inflow", "wind"}};
  for (const auto& [a, b] : wanted) result.push_back({named(a), named(b)});
  return result;
}

}  // namespace swarmcert::tests
