#include <fmt/core.h>

#include <cmath>
#include <utility>

#include "analysis/logs/interpretation.h"
#include "analysis/logs/smoother.h"
#include "analysis/logs/statistics_of_series.h"

namespace swarmcert::logs {
namespace {

using Source = SignalInfo::Source;

/// Returns the standard deviation of the noise of a derived acceleration: the residual of the smoother is taken as the
/// noise of the column and propagated through the weights of the smoother. The autocorrelation of the noise is
/// included.
/// @param smooth local_derivatives() of order 0.
double noise_of_slope(const SignalTable& t, const std::vector<double>& column,
                      const std::vector<double>& smooth, double window_s, int derivative) {
  std::vector<double> left(column.size());
  for (std::size_t i = 0; i < column.size(); ++i) left[i] = column[i] - smooth[i];
  // A vehicle at rest shows less noise than a flying one.
  constexpr double kMoving_m_s = 0.03;
  std::vector<double> sizes;
  for (std::size_t i = 0; i < left.size(); ++i) {
    double speed = 0;
    for (int k = 0; k < 3; ++k) {
      if (t.has(kVelocity + k)) speed = std::max(speed, std::abs(t[kVelocity + k][i]));
    }
    if (speed < kMoving_m_s) left[i] = std::nan("");
    sizes.push_back(std::abs(left[i]));
  }
  const double typical =
      median(sizes) / 0.6745;  // 0.6745: median absolute value of a standard normal variable
  double squares = 0, products = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < column.size(); ++i) {
    if (!(std::abs(left[i]) < 3 * typical)) left[i] = std::nan("");
    if (i == 0 || t.restarts[i] != 0 || !std::isfinite(left[i]) || !std::isfinite(left[i - 1])) continue;
    squares += left[i] * left[i];
    products += left[i] * left[i - 1];
    ++count;
  }
  const double step_s = t.step_s();
  if (count < 10 || !(step_s > 0)) return std::nan("");
  const double sigma = std::sqrt(squares / static_cast<double>(count));
  const double rho = squares > 0 ? std::min(std::max(products / squares, 0.0), 0.95) : 0;
  const double runs = (1 + rho) / (1 - rho), n = std::max(window_s / step_s, 3.0);
  // Variance over n uniform steps: of a fitted slope 12 sigma^2 / (n w^2),
  // of a second derivative 720 sigma^2 / (n w^4).
  return derivative == 1 ? sigma * std::sqrt(12 * runs / n) / window_s
                         : sigma * std::sqrt(720 * runs / n) / (window_s * window_s);
}

Vector rotated(const SignalTable& t, std::size_t i, const Vector& body) {
  const auto R = t.attitude(i).rotation();
  Vector world{};
  for (std::size_t r = 0; r < 3; ++r) world[r] = R[r][0] * body[0] + R[r][1] * body[1] + R[r][2] * body[2];
  return world;
}

/// nav_msgs/Odometry specifies velocities in the body frame, but Crazyswarm2 and motion capture write world-frame
/// velocities into it and into TwistStamped. The derivative of the position shows which it is.
void settle_velocity_frame(Draft& draft) {
  const Carried* const carried = draft.recognition.find(kVelocity);
  if (carried == nullptr || carried->ask != Ask::kVelocityFrame || !draft.asks_physics) return;
  SignalTable& t = draft.table;
  const std::string names = names_of(draft.raw, *carried);
  if (!t.has_group(kVelocity, 3) || !t.has_group(kPosition, 3) || !t.has_group(kAttitude, 4)) {
    draft.note(
        names +
        ": assumed along the axes of the world, which cannot be checked without position and quaternion");
    return;
  }
  std::array<std::vector<double>, 3> slope, turned;
  for (int k = 0; k < 3; ++k) {
    slope[static_cast<std::size_t>(k)] =
        local_derivatives(t, t[kPosition + k], velocity_window_s(t.step_s()), 2, {1})[0];
    turned[static_cast<std::size_t>(k)].resize(t.size());
  }
  std::vector<double> as_world, as_body;
  for (std::size_t i = 0; i < t.size(); ++i) {
    const Vector body = t.three(kVelocity, i), world = rotated(t, i, body);
    for (std::size_t k = 0; k < 3; ++k) {
      turned[k][i] = world[k];
      as_world.push_back(std::pow(slope[k][i] - body[k], 2));
      as_body.push_back(std::pow(slope[k][i] - world[k], 2));
    }
  }
  const double world_m_s = std::sqrt(mean_of(as_world)), body_m_s = std::sqrt(mean_of(as_body));
  const bool is_body = body_m_s < world_m_s;
  draft.note(fmt::format(
      "{}: along the axes of the {}; {:.2g} m/s from the derivative of the position, against {:.2g}", names,
      is_body ? "body" : "world", is_body ? body_m_s : world_m_s, is_body ? world_m_s : body_m_s));
  if (!is_body) return;
  for (std::size_t k = 0; k < 3; ++k) t[kVelocity + static_cast<int>(k)] = turned[k];
}

}  // namespace

void derive_kinematics(Draft& draft) {
  SignalTable& t = draft.table;
  Signals& signals = draft.log.signals;
  settle_velocity_frame(draft);
  signals.position = t.has_group(kPosition, 3);
  const char* const axes[] = {"x", "y", "z"};
  draft.add_measured_or_missing("position", kPosition,
                                t.has(kPosition) || t.has(kPosition + 1) || t.has(kPosition + 2));
  const bool has_velocity = t.has(kVelocity) || t.has(kVelocity + 1) || t.has(kVelocity + 2);
  const double step_s = t.step_s();
  const double velocity_s = velocity_window_s(step_s), position_s = position_window_s(step_s);
  draft.log.window_s = has_velocity ? velocity_s : position_s;
  std::string velocity_from, from;
  double noise = 0, velocity_noise = 0;
  for (int k = 0; k < 3; ++k) {
    auto& acceleration = draft.acceleration_m_s2[static_cast<std::size_t>(k)];
    double axis_noise = std::nan("");
    if (t.has(kVelocity + k)) {
      std::vector<std::vector<double>> fits = local_derivatives(t, t[kVelocity + k], velocity_s, 2, {0, 1});
      acceleration = std::move(fits[1]);
      axis_noise = noise_of_slope(t, t[kVelocity + k], fits[0], velocity_s, 1);
    } else if (t.has(kPosition + k)) {
      const std::vector<double>& position = t[kPosition + k];
      std::vector<std::vector<double>> fits = local_derivatives(t, position, velocity_s, 2, {0, 1});
      t[kVelocity + k] = std::move(fits[1]);
      velocity_noise = std::max(velocity_noise, noise_of_slope(t, position, fits[0], velocity_s, 1));
      for (double& v : t[kVelocity + k]) v = std::isfinite(v) ? v : 0;
      velocity_from += axes[k];
      fits = local_derivatives(t, position, position_s, 3, {0, 2});
      acceleration = std::move(fits[1]);
      axis_noise = noise_of_slope(t, position, fits[0], position_s, 2);
    } else {
      continue;
    }
    from += axes[k];
    if (std::isfinite(axis_noise)) noise = std::max(noise, axis_noise);
  }
  if (!has_velocity && !velocity_from.empty())
    draft.add("velocity", Source::kDerived, "position " + velocity_from + ": local quadratic over 100 ms",
              "m/s", velocity_noise);
  else
    draft.add_measured_or_missing("velocity", kVelocity, has_velocity);
  if (from.empty()) {
    draft.add("acceleration", Source::kMissing, "", "m/s^2");
    return;
  }
  draft.add("acceleration", Source::kDerived,
            has_velocity ? fmt::format("velocity {}: local quadratic over {:.0f} ms", from, 1000 * velocity_s)
                         : fmt::format("position {}: local cubic over {:.0f} ms", from, 1000 * position_s),
            "m/s^2", noise);
}

void settle_specific_force(Draft& draft) {
  SignalTable& t = draft.table;
  Signals& signals = draft.log.signals;
  if (t.has_group(kForceWorld, 3)) {
    signals.specific_force = ForceSource::kAccelerometer;
    draft.add_measured("specific_force", kForceWorld);
  } else if (t.has_group(kForceBody, 3) && (signals.attitude || draft.acceleration_m_s2[2].empty())) {
    // Without any attitude the body's axes stand for those of the world, of which only the thrust axis is judged.
    if (!signals.attitude) draft.note("no attitude: the force is judged along the thrust axis of the body");
    for (int k = 0; k < 3; ++k) t[kForceWorld + k].resize(t.size());
    for (std::size_t i = 0; i < t.size(); ++i) {
      const Vector world = rotated(t, i, t.three(kForceBody, i));
      for (int k = 0; k < 3; ++k) t[kForceWorld + k][i] = world[static_cast<std::size_t>(k)];
    }
    signals.specific_force = ForceSource::kAccelerometer;
    draft.add_measured("specific_force", kForceBody);
  } else if (!draft.acceleration_m_s2[2].empty()) {
    signals.specific_force = draft.is_measured(kVelocity) ? ForceSource::kVelocity : ForceSource::kPosition;
    for (int k = 0; k < 3; ++k) {
      const auto& acceleration = draft.acceleration_m_s2[static_cast<std::size_t>(k)];
      t[kForceWorld + k].assign(t.size(), k == 2 ? kGravity_m_s2 : 0);
      for (std::size_t i = 0; i < acceleration.size(); ++i) {
        if (std::isfinite(acceleration[i])) t[kForceWorld + k][i] += acceleration[i];
      }
    }
    draft.add("specific_force", Source::kDerived, "acceleration + g", "m/s^2");
    for (const SignalInfo& info : draft.log.sources) {
      if (info.name == "acceleration") draft.log.sources.back().noise = info.noise;
    }
    return;
  } else {
    draft.add("specific_force", Source::kMissing, "", "m/s^2");
    return;
  }
  // Two independent measurements: their difference is the noise of the derived one, apart from the sensor's.
  const std::array<std::vector<double>, 3> force = {t[kForceWorld], t[kForceWorld + 1], t[kForceWorld + 2]};
  std::vector<double> differences;
  for (std::size_t k = 0; k < 3; ++k) {
    if (draft.acceleration_m_s2[k].empty()) continue;
    const std::vector<double> smooth =
        local_derivatives(t, force[k], velocity_window_s(t.step_s()), 2, {0})[0];
    std::vector<double> axis;
    for (std::size_t i = 0; i < smooth.size(); ++i) {
      const bool lateral = t.has(kVelocity) && t.has(kVelocity + 1);
      if (!lateral || std::hypot(t[kVelocity][i], t[kVelocity + 1][i]) < 0.5)
        axis.push_back(smooth[i] - draft.acceleration_m_s2[k][i]);
    }
    const double middle = median(axis);
    for (const double d : axis) differences.push_back(std::abs(d - middle));
  }
  if (differences.size() < 100) return;
  for (SignalInfo& info : draft.log.sources) {
    // 0.6745: median absolute value of a standard normal variable.
    if (info.name == "acceleration") info.noise = median(differences) / 0.6745;
  }
}

}  // namespace swarmcert::logs
