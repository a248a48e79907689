#include "analysis/identification/balance/motion_balance.h"

#include <fmt/core.h>

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "analysis/identification/balance/motion_estimates.h"
#include "analysis/residuals/log_cache.h"
#include "analysis/residuals/over_tracks.h"
#include "analysis/residuals/velocity_error.h"
#include "nn/base/pi.h"

namespace swarmcert::identification {
namespace {

using residuals::Track;

constexpr double kDegrees = 180 / kPi;
constexpr std::size_t kFlightsAsUnits = 5, kFewestUnits = 3;

/// Least contradictions that are said.
constexpr double kLeastScaleError = 0.02, kLeastLag_s = 0.01, kLeastHeading_rad = 3 / kDegrees;
/// A calibrated accelerometer has an offset of up to 0.035 g.
constexpr double kLeastTilt_rad = 2 / kDegrees;

double part_of_units_s(std::size_t flights) {
  constexpr double kPart_s = 10;
  return flights >= kFlightsAsUnits ? std::numeric_limits<double>::infinity() : kPart_s;
}

/// A mean with half of its 99 % interval.
struct MotionMean {
  double value = 0, half = 0;
};

/// The units of one vehicle.
class VehicleMotion {
 public:
  void add(const std::vector<MotionEstimates>& units) {
    units_.insert(units_.end(), units.begin(), units.end());
  }

  /// Returns nothing if there are fewer than kFewestUnits.
  std::optional<MotionMean> mean(const std::string& quantity) const {
    std::vector<double> values;
    for (const MotionEstimates& unit : units_) {
      const auto found = unit.find(quantity);
      if (found != unit.end()) values.push_back(found->second);
    }
    if (values.size() < kFewestUnits) return std::nullopt;
    const auto n = static_cast<double>(values.size());
    double mean = 0, squares = 0;
    for (const double value : values) mean += value / n;
    for (const double value : values) squares += (value - mean) * (value - mean);
    const double student = boost::math::quantile(boost::math::students_t(n - 1), 0.995);
    return MotionMean{mean, student * std::sqrt(squares / (n * (n - 1)))};
  }

 private:
  std::vector<MotionEstimates> units_;
};

void add_velocity_scale(const VehicleMotion& motion, std::vector<MotionFault>& faults) {
  const auto least = motion.mean("least_velocity_scale"), largest = motion.mean("largest_velocity_scale");
  if (!least || !largest) return;
  const double from = least->value - least->half, to = largest->value + largest->half;
  if (from < 1 + kLeastScaleError && to > 1 - kLeastScaleError) return;
  const double value = (from + to) / 2;
  faults.push_back(
      {"", "", "velocity_scale", value, (to - from) / 2,
       fmt::format("velocities are {:.3f} times the differences of positions, 99 % interval {:.3f} "
                   "to {:.3f}",
                   value, from, to)});
}

/// What is said about a quantity that should be 0.
struct MotionRule {
  const char* quantity;
  double least;              ///< size that is said
  double unit;               ///< of the numbers in words
  const char *plus, *minus;  ///< words for either sign, with the absolute value
  const char* interval;      ///< words for the 99 % interval of the absolute value
};

constexpr char kLagInterval[] = ", 99 % interval {:.0f} to {:.0f} ms";
constexpr char kAngleInterval[] = ", 99 % interval {:.1f} to {:.1f} degrees";

const MotionRule kMotionRules[] = {
    {"position_lag_s", kLeastLag_s, 1e-3, "positions are {:.0f} ms later than velocities",
     "positions are {:.0f} ms earlier than velocities", kLagInterval},
    {"velocity_lag_s", kLeastLag_s, 1e-3, "velocities are {:.0f} ms later than attitudes and specific forces",
     "velocities are {:.0f} ms earlier than attitudes and specific forces", kLagInterval},
    {"attitude_lag_s", kLeastLag_s, 1e-3, "attitudes are {:.0f} ms later than rates",
     "attitudes are {:.0f} ms earlier than rates", kLagInterval},
    {"heading_rad", kLeastHeading_rad, 1 / kDegrees,
     "attitudes are turned by {:.1f} degrees about the vertical (clockwise seen from above) against "
     "velocities",
     "attitudes are turned by {:.1f} degrees about the vertical (anticlockwise seen from above) against "
     "velocities",
     kAngleInterval}};

void add_fault(const VehicleMotion& motion, const MotionRule& rule, std::vector<MotionFault>& faults) {
  const auto found = motion.mean(rule.quantity);
  if (!found || !(std::abs(found->value) - found->half > rule.least)) return;
  const double size = std::abs(found->value) / rule.unit, half = found->half / rule.unit;
  faults.push_back({"", "", rule.quantity, found->value, found->half,
                    fmt::format(fmt::runtime(found->value > 0 ? rule.plus : rule.minus), size) +
                        fmt::format(fmt::runtime(rule.interval), size - half, size + half)});
}

/// Adds the tilt in the frame in which a constant one leaves less.
void add_tilt(const VehicleMotion& motion, std::vector<MotionFault>& faults) {
  constexpr double kClearly = 2;
  const auto square_W = motion.mean("square_W"), square_B = motion.mean("square_B");
  if (!square_W || !square_B) return;
  const bool is_in_body = square_B->value < square_W->value;
  const std::string frame = is_in_body ? "B" : "W";
  const auto x = motion.mean("tilt_x_" + frame), y = motion.mean("tilt_y_" + frame);
  if (!x || !y) return;
  const double tilt_rad = std::hypot(x->value, y->value), half_rad = std::hypot(x->half, y->half);
  if (!(tilt_rad - half_rad > kLeastTilt_rad)) return;
  const double larger = std::max(square_W->value, square_B->value),
               smaller = std::min(square_W->value, square_B->value);
  const double size = kDegrees * tilt_rad, half = kDegrees * half_rad;
  const char* const cause = larger < kClearly * smaller ? "a frame or a sensor is tilted"
                            : is_in_body                ? "a sensor is tilted on the vehicle"
                                                        : "the frame of positions or attitudes is tilted";
  faults.push_back(
      {"", "", "tilt_rad", tilt_rad, half_rad,
       fmt::format("specific forces are tilted by {:.1f} degrees against changes of velocities", size) +
           fmt::format(fmt::runtime(kAngleInterval), size - half, size + half) + ": " + cause});
}

std::vector<MotionFault> faults_of(const VehicleMotion& motion) {
  std::vector<MotionFault> faults;
  add_velocity_scale(motion, faults);
  for (const MotionRule& rule : kMotionRules) add_fault(motion, rule, faults);
  add_tilt(motion, faults);
  return faults;
}

}  // namespace

std::vector<MotionFault> motion_faults(const residuals::Inputs& inputs, const std::string& kind, int jobs) {
  const double part_s = part_of_units_s(inputs.found.flights.size());
  using OfTrack = std::pair<std::string, std::vector<MotionEstimates>>;
  const auto tracks =
      residuals::over_tracks<OfTrack>(inputs, jobs, [&](const Track& track, std::vector<OfTrack>& all) {
        if (track.kind != kind) return;
        const bool measures = residuals::measures_velocity(inputs.cache->log(track.path, inputs.map)->log);
        all.emplace_back(track.vehicle, motion_estimates(track, measures, part_s));
      });
  std::map<std::string, VehicleMotion> vehicles;
  for (const auto& [vehicle, units] : tracks) vehicles[vehicle].add(units);
  std::vector<MotionFault> all;
  for (const auto& [vehicle, motion] : vehicles) {
    for (MotionFault& fault : faults_of(motion)) {
      fault.kind = kind;
      fault.vehicle = vehicle;
      all.push_back(std::move(fault));
    }
  }
  return all;
}

std::vector<MotionFault> motion_faults(const std::vector<Track>& tracks) {
  VehicleMotion motion;
  for (const Track& track : tracks) motion.add(motion_estimates(track, true, part_of_units_s(tracks.size())));
  return faults_of(motion);
}

}  // namespace swarmcert::identification
