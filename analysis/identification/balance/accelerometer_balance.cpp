#include "analysis/identification/balance/accelerometer_balance.h"

#include <fmt/core.h>

#include <Eigen/Geometry>
#include <cmath>

#include "analysis/identification/balance/force_means.h"
#include "analysis/identification/balance/vehicle_blocks.h"
#include "stability/effects/registry.h"

namespace swarmcert::identification {
namespace {

using residuals::Track;

constexpr double kMotionBlock_s = 1, kOffset_z = 2;
/// Upper bound on the lag of filtered accelerometers and delayed attitudes.
constexpr double kLongestLag_s = 0.02;
constexpr std::size_t kFewestMotionBlocks = 10;

/// Means over a second without cuts.
struct MotionBlock {
  Eigen::Vector3d of_velocity_m_s2, measured_m_s2;
  /// Vertical acceleration that a lag of the accelerometer behind the attitude adds to the measured mean, per second of
  /// lag, because the body rotates meanwhile. For a filter a' = (a_B - a) / lag, measured = R a = R a_B - lag R a', and
  /// R a' = (R a)' - omega x (R a), whose first part has zero mean.
  double of_lag_m_s3;
};

double turned_upwards_m_s3(const Track& track, std::size_t i) {
  const stability::Instant& now = track.instants[i];
  return (now.R_WB * now.omega_B_rad_s).cross(track.specific_force_m_s2[i]).z();
}

/// Uses the trapezoidal rule over the same time as the mean of the force.
double mean_turned_m_s3(const Track& track, const ForceMean& one) {
  double integral_m_s2 = 0;
  for (std::size_t i = one.first + 1; i <= one.last; ++i)
    integral_m_s2 += (track.instants[i].time_s - track.instants[i - 1].time_s) / 2 *
                     (turned_upwards_m_s3(track, i - 1) + turned_upwards_m_s3(track, i));
  return integral_m_s2 / (track.instants[one.last].time_s - track.instants[one.first].time_s);
}

/// @param scale divides the measured force
std::vector<MotionBlock> motion_blocks(const Track& track, double scale) {
  std::vector<MotionBlock> blocks;
  for (const ForceMean& one : specific_force_means(track, kMotionBlock_s)) {
    const stability::Instant &from = track.instants[one.first], &to = track.instants[one.last];
    blocks.push_back({(to.v_W_m_s - from.v_W_m_s) / (to.time_s - from.time_s) +
                          stability::kGravity_m_s2 * Eigen::Vector3d::UnitZ(),
                      one.mean_m_s2 / scale, mean_turned_m_s3(track, one) / scale});
  }
  return blocks;
}

/// Fits the scale along the vertical, where gravity makes it visible.
void fit_scale(const std::vector<MotionBlock>& blocks, double mass_kg, AccelerometerBalance& balance) {
  std::vector<double> x, y, gains;
  double offset_m_s2 = 0, of_lag_m_s3 = 0;
  for (const MotionBlock& block : blocks) {
    x.push_back(block.of_velocity_m_s2.z());
    y.push_back(block.measured_m_s2.z());
    offset_m_s2 += (y.back() - x.back()) / static_cast<double>(blocks.size());
    of_lag_m_s3 += block.of_lag_m_s3 / static_cast<double>(blocks.size());
  }
  balance.scale = fit_through_origin(x, y);
  double before = 0, after = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double off = y[i] - x[i], by_scale = y[i] - balance.scale.value * x[i],
                 by_offset = off - offset_m_s2;
    gains.push_back(by_offset * by_offset - by_scale * by_scale);
    before += off * off;
    after += by_scale * by_scale;
  }
  balance.z = mean_z(gains);
  const double count = static_cast<double>(x.size());
  balance.rmse_before_N = mass_kg * std::sqrt(before / count);
  balance.rmse_after_N = mass_kg * std::sqrt(after / count);
  balance.of_lag = kLongestLag_s * std::abs(of_lag_m_s3) / stability::kGravity_m_s2;
  const double surely_off = std::abs(balance.scale.value - 1) - balance.scale.half - balance.of_lag;
  balance.is_named = surely_off > kOrdinaryScaleError && balance.z >= -kOffset_z;
}

}  // namespace

bool AccelerometerBalance::may_be_offset() const { return z < kOffset_z; }

bool explains_ratio(const AccelerometerBalance& balance, double ratio, double half) {
  constexpr double kErrorOfGravity = 0.005;  // from the equator to the poles it varies by 0.0053 of itself
  const double off = std::abs(balance.scale.value - 1) - balance.scale.half - balance.of_lag;
  const double apart = std::abs(ratio - balance.scale.value);
  return off > kErrorOfGravity && balance.z >= -kOffset_z &&
         apart <= std::hypot(half, balance.scale.half) + balance.of_lag;
}

double modelled_accelerometer_scale(const stability::Model& model, const std::string& vehicle) {
  double scale = 1;
  for (const stability::EffectSpec& spec : model.effects) {
    if (stability::traits_of(spec.name).shown_by != stability::ShownBy::kAccelerometer ||
        !spec.acts_on(vehicle))
      continue;
    const auto value = spec.parameters.find("scale");
    if (value != spec.parameters.end()) scale *= value->second;
  }
  return scale;
}

stability::EffectSpec spec_of(const AccelerometerBalance& balance) {
  stability::EffectSpec spec;
  spec.name = stability::effect_shown_by(stability::ShownBy::kAccelerometer);
  spec.vehicle = balance.vehicle;
  spec.parameters["scale"] = balance.scale.value;
  spec.fit.interval["scale"] = {balance.scale.value - balance.scale.half,
                                balance.scale.value + balance.scale.half};
  return spec;
}

std::vector<AccelerometerBalance> accelerometer_balances(const residuals::Inputs& inputs,
                                                         const std::string& kind, int jobs) {
  return balances_by_vehicle<AccelerometerBalance, MotionBlock>(
      inputs, kind, jobs, kFewestMotionBlocks,
      [&](const Track& track) -> std::optional<std::vector<MotionBlock>> {
        if (track.force_source != logs::ForceSource::kAccelerometer || !(track.judged.z() > 0))
          return std::nullopt;
        const double scale = modelled_accelerometer_scale(inputs.model_for(track), track.vehicle);
        return motion_blocks(track, scale);
      },
      [&](const std::vector<MotionBlock>& blocks, AccelerometerBalance& balance) {
        fit_scale(blocks, inputs.model_of(kind)->mass_kg, balance);
      });
}

std::string in_words(const AccelerometerBalance& balance) {
  return fmt::format(
      "the accelerometer reads {:.3f} times what the velocity says (90 %: {:.3f} .. {:.3f}){}",
      balance.scale.value, balance.scale.value - balance.scale.half, balance.scale.value + balance.scale.half,
      balance.is_named && balance.may_be_offset() ? ", or has an offset along the vertical" : "");
}

}  // namespace swarmcert::identification
