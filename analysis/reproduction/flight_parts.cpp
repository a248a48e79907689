#include "analysis/reproduction/flight_parts.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "stability/model.h"

namespace swarmcert::reproduction {
namespace {

using stability::CascadeInput;

/// sup |(h * v)(t)| for v sampled at kSetPointStep_s, by the trapezoidal rule.
double largest_response(const stability::TransferFunction& h, const std::vector<double>& v) {
  const std::vector<double> kernel =
      stability::sampled_response(h, kSetPointStep_s, static_cast<int>(v.size()));
  double largest = 0;
  for (std::size_t n = 0; n < v.size(); ++n) {
    double sum = -(kernel[0] * v[n] + kernel[n] * v[0]) / 2;
    for (std::size_t k = 0; k <= n; ++k) sum += kernel[k] * v[n - k];
    largest = std::max(largest, std::abs(sum) * kSetPointStep_s);
  }
  return largest;
}

/// The body axis about which the vehicle tilts to accelerate along a horizontal world axis, with heading near zero.
std::size_t tilt_axis(std::size_t axis) { return 1 - axis; }

}  // namespace

const char* track_name(Track track) {
  return track == Track::kAlong ? "along" : track == Track::kAcross ? "across" : "z";
}

Track track_of(const GainFlight& flight, std::size_t axis) {
  if (axis == 2) return Track::kVertical;
  return flight.axes[axis].moves() ? Track::kAlong : Track::kAcross;
}

std::string gain_set(const GainFlight& flight, std::size_t axis) {
  const FlownGains& g = flight.gains;
  std::string text = fmt::format("Kp {:g} Kd {:g} Ki {:g}", g.Kp[axis], g.Kd[axis], g.Ki[axis]);
  if (axis == 2) return text;
  const std::size_t tilt = tilt_axis(axis);
  return text + fmt::format(" KR {:g} Kw {:g} KI {:g}", g.KR[tilt], g.Kw[tilt], g.KI[tilt]);
}

std::string set_point_class(const GainFlight& flight, std::size_t axis) {
  return fmt::format("{}, {:.1f} m, {:.1f} m/s",
                     flight.gains.motors.empty() ? "unknown motors" : flight.gains.motors,
                     flight.axes[axis].range_m, flight.axes[axis].speed_m_s);
}

stability::Cascade flown_cascade(const GainFlight& flight, std::size_t axis, const CascadePlant& plant,
                                 double ratio) {
  const FlownGains& g = flight.gains;
  stability::Cascade loop{g.Kp[axis], g.Kd[axis], g.Ki[axis], ratio, std::nullopt, plant.lag_s};
  if (axis == 2) return loop;
  const std::size_t tilt = tilt_axis(axis);
  const double inertia = plant.inertia_kg_m2[tilt];
  loop.attitude = stability::AttitudeLoop{g.KR[tilt] / inertia, g.Kw[tilt] / inertia, g.KI[tilt] / inertia};
  return loop;
}

const std::vector<std::string>& part_names() {
  static const std::vector<std::string> names = {"force, amplitude",
                                                 "force, edge",
                                                 "velocity error, amplitude",
                                                 "velocity error, edge",
                                                 "torque, amplitude",
                                                 "torque, edge",
                                                 "force with the set point's velocity",
                                                 "velocity error with the set point's velocity"};
  return names;
}

const std::vector<std::string>& part_units() {
  static const std::vector<std::string> units = {"m/s^2",   "m/s^2",   "m/s", "m/s",
                                                 "rad/s^2", "rad/s^2", "1/s", "1"};
  return units;
}

const std::vector<double>& FlightParts::norms(const GainFlight& flight, std::size_t axis, double ratio) {
  std::vector<double>& result = norms_[fmt::format("{} {} {:.2f}",
                                                   axis == 2   ? "z"
                                                   : axis == 1 ? "y"
                                                               : "x",
                                                   gain_set(flight, axis), ratio)];
  if (!result.empty()) return result;
  const stability::Cascade loop = flown_cascade(flight, axis, plant_, ratio);
  for (const CascadeInput input :
       {CascadeInput::kAcceleration, CascadeInput::kVelocityError, CascadeInput::kAngularAcceleration}) {
    if (input == CascadeInput::kAngularAcceleration && !loop.attitude) {
      result.insert(result.end(), {0, 0});
      continue;
    }
    const stability::ResponseNorms h = stability::response_norms(cascade_transfer(loop, input));
    result.insert(result.end(), {h.integral_abs, h.step_max_abs});
  }
  return result;
}

const std::vector<double>& FlightParts::of(const GainFlight& flight, std::size_t axis, double ratio) {
  const double rounded = std::round(100 * ratio) / 100;
  std::vector<double>& result = parts_[fmt::format("{} {} {:.2f}", flight.sha256, axis, rounded)];
  if (!result.empty()) return result;
  result = norms(flight, axis, rounded);
  const stability::Cascade loop = flown_cascade(flight, axis, plant_, rounded);
  for (const CascadeInput input : {CascadeInput::kAcceleration, CascadeInput::kVelocityError}) {
    result.push_back(!flight.axes[axis].moves() ? 0
                     : !is_stable(loop)
                         ? INFINITY
                         : largest_response(cascade_transfer(loop, input), flight.axes[axis].set_point_m_s));
  }
  return result;
}

double steady_error_m(const GainFlight& flight, std::size_t axis, double ratio) {
  if (axis != 2 || flight.gains.Ki[2] > 0) return 0;
  return std::abs(stability::kGravity_m_s2 * (1 - 1 / ratio)) / flight.gains.Kp[2];
}

}  // namespace swarmcert::reproduction
