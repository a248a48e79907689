#include "stability/simulation/float_errors.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "controller/rounding/rounding_bounds.h"
#include "stability/simulation/pilot.h"

namespace swarmcert::stability {
namespace {

controller::Vector3<double> vector_of(const PerAxis& v) { return {v[0], v[1], v[2]}; }

/// Period of a loop without a stated rate: that of the fastest position loop of the published firmware.
constexpr double kUnstatedPeriod_s = 0.002;

}  // namespace

FloatErrors float_errors(const FlownLoop& input, const TrackingReport& report) {
  const Gains& gains = input.gains;
  const double period_s = gains.rate_hz > 0 ? 1 / gains.rate_hz : kUnstatedPeriod_s;
  controller::RoundedLaw law;
  law.mass_kg = input.plant.mass_kg;
  law.is_composite = gains.composite.has_value();
  if (gains.composite) law.composite = *gains.composite;
  if (gains.pid) law.pid = *gains.pid;
  law.integrator = {vector_of(gains.integrator_limit_m_s),
                    gains.rate_hz > 0 ? gains.integrator_step_s : kUnstatedPeriod_s};
  constexpr double kAttitudePeriod_s = 0.002;
  Pilot<double>(gains, input.model, kAttitudePeriod_s).with_settings([&law](const auto& settings) {
    law.thrust_rule = settings.thrust_rule;
    law.is_robust = settings.attitude_law == controller::AttitudeLaw::kRobust;
    law.lee = settings.lee;
    law.robust = settings.robust;
    law.attitude_step_s = settings.attitude_step_s;
    law.inertia_kg_m2 = settings.inertia_kg_m2;
  });
  const controller::RoundingBounds bounds = rounding_bounds(law, {});
  FloatErrors errors;
  errors.applies = bounds.applies;
  errors.why_not = bounds.why_not;
  const double force[] = {bounds.force_N.x, bounds.force_N.y, bounds.force_N.z};
  const double torque[] = {bounds.torque_N_m.x, bounds.torque_N_m.y, bounds.torque_N_m.z};
  errors.thrust_N = bounds.thrust_N;
  const double integral[] = {bounds.integral_m_s.x, bounds.integral_m_s.y, bounds.integral_m_s.z};
  const Loop flown = gains.rate_hz > 0 ? Loop::kSampled : Loop::kContinuous;
  for (std::size_t i = 0; i < 3; ++i) {
    errors.force_N[i] = force[i];
    errors.integral_m_s[i] = integral[i];
    errors.torque_N_m[i] = torque[i];
    errors.tracking_error_m[i] = std::numeric_limits<double>::infinity();
    const std::optional<AxisLoop> loop = input.continuous(static_cast<int>(i));
    for (const ExactGains& row : report.exact) {
      if (!loop || row.axis != static_cast<int>(i) || row.channel != Channel::kCommand || row.loop != flown)
        continue;
      const double rate_N_s = loop->mass_kg * loop->Ki / input.integral_share() * integral[i] / period_s;
      errors.tracking_error_m[i] = row.all_times.amplitude * std::max(force[i], bounds.thrust_N) +
                                   (rate_N_s > 0 ? row.all_times.rate * rate_N_s : 0);
    }
  }
  return errors;
}

}  // namespace swarmcert::stability
