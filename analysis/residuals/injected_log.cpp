#include "analysis/residuals/injected_log.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "analysis/residuals/force_residual.h"
#include "stability/simulation/sensors.h"

namespace swarmcert::residuals {
namespace {

/// Rounds to the nearest thousandth, so that values read from thousandths are reproduced exactly.
std::int16_t nearest_milli(double value) {
  return static_cast<std::int16_t>(std::lround(std::clamp(1000 * value, -32768.0, 32767.0)));
}

}  // namespace

std::vector<stability::LogRecord> injected_log(const Inputs& inputs, const Track& track) {
  const stability::Model model = inputs.model_for(track);
  stability::Model nominal = model;
  nominal.effects.clear();
  Track scratch = track;
  apply_model(nominal, inputs.kinds, inputs.rules, scratch);
  const auto without = force_residual(nominal, inputs.kinds, inputs.rules, scratch);
  apply_model(model, inputs.kinds, inputs.rules, scratch);
  const auto with = force_residual(model, inputs.kinds, inputs.rules, scratch);
  std::vector<stability::LogRecord> records;
  records.reserve(track.instants.size());
  for (std::size_t i = 0; i < track.instants.size(); ++i) {
    const stability::Instant& now = track.instants[i];
    const Eigen::Vector3d a = track.specific_force_m_s2[i] + (without[i] - with[i]) / model.mass_kg;
    stability::LogRecord log;
    log.tick_us = static_cast<std::uint32_t>(std::llround(1e6 * (now.time_s + track.clock_offset_s)));
    log.quaternion = stability::compress_quaternion(Eigen::Quaterniond(now.R_WB));
    for (std::size_t k = 0; k < 3; ++k) {
      const auto axis = static_cast<int>(k);
      auto& kinematics = log.position_mm_velocity_mm_s_acceleration_mm_s2;
      kinematics[k] = nearest_milli(now.p_W_m[axis]);
      kinematics[3 + k] = nearest_milli(now.v_W_m_s[axis]);
      kinematics[6 + k] = nearest_milli(a[axis]);
      log.rates_mrad_s[k] = nearest_milli(now.omega_B_rad_s[axis]);
      if (track.targets.empty()) continue;
      log.target_mm_mm_s[k] = nearest_milli(track.targets[i].p_W_m[axis]);
      log.target_mm_mm_s[3 + k] = nearest_milli(track.targets[i].v_W_m_s[axis]);
    }
    for (std::size_t k = 0; k < 4; ++k)
      log.pwm[k] = static_cast<std::uint32_t>(std::lround(65536 * track.duty[i][k]));
    log.battery_mV = static_cast<std::uint16_t>(std::lround(1000 * now.battery_V));
    records.push_back(log);
  }
  return records;
}

}  // namespace swarmcert::residuals
