#include "analysis/residuals/velocity_error.h"

#include <algorithm>

#include "analysis/residuals/smoothing_window.h"

namespace swarmcert::residuals {

bool measures_velocity(const logs::Log& log) {
  const auto is_measured = [&log](const char* signal) {
    return std::any_of(log.sources.begin(), log.sources.end(), [signal](const logs::SignalInfo& info) {
      return info.name == signal && info.source == logs::SignalInfo::Source::kMeasured;
    });
  };
  return is_measured("position") && is_measured("velocity");
}

std::vector<Eigen::Vector3d> velocity_error(const Track& track) {
  // Fitting the difference of position and integrated velocity leaves only a small signal for the window to average.
  SmoothingWindow window(logs::ForceSource::kVelocity, kSlopeWindow_s, 1);
  std::vector<Eigen::Vector3d> errors;
  Eigen::Vector3d flown = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < track.instants.size(); ++i) {
    const stability::Instant& now = track.instants[i];
    if (track.restarts[i] != 0) {
      window.restart();
      flown = now.p_W_m;
    } else if (i > 0) {
      const stability::Instant& before = track.instants[i - 1];
      flown += (now.time_s - before.time_s) / 2 * (now.v_W_m_s + before.v_W_m_s);
    }
    Eigen::Matrix3Xd difference = now.p_W_m - flown;
    window.differentiate(now.time_s, difference);
    errors.emplace_back(-difference.col(0));
  }
  return errors;
}

VelocityError velocity_error(const std::vector<Eigen::Vector4d>& bias,
                             const std::vector<ErrorWindow>& windows) {
  const LearningError of = learning_error(bias, windows);
  return {of.windows, of.bias_N, of.amplitude_N, of.rate_N_s, of.variation_N, of.impulse_N_s};
}

}  // namespace swarmcert::residuals
