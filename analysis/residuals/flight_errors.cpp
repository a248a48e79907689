#include "analysis/residuals/flight_errors.h"

#include "analysis/residuals/force_residual.h"
#include "analysis/residuals/log_cache.h"
#include "analysis/residuals/over_tracks.h"

namespace swarmcert::residuals {

namespace {

ErrorOfFlight error_of(const Track& track, const std::vector<Eigen::Vector3d>& error) {
  ErrorOfFlight result;
  result.windows = error_windows(track, error);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t n = 0; n < error.size(); ++n)
    if (track.cut[n] == Cut::kNone) sum += error[n];
  result.bias = with_norm(sum / static_cast<double>(track.used));
  return result;
}

}  // namespace

ErrorWindow ErrorOfFlight::largest() const {
  ErrorWindow most = windows.front();
  for (const ErrorWindow& window : windows) {
    most.amplitude = most.amplitude.cwiseMax(window.amplitude);
    most.rate = most.rate.cwiseMax(window.rate);
    most.variation = most.variation.cwiseMax(window.variation);
    most.impulse = most.impulse.cwiseMax(window.impulse);
  }
  return most;
}

std::optional<FlightError> flight_error(const Inputs& inputs, const Track& track) {
  if (track.position_only || track.used == 0) return std::nullopt;
  const std::vector<Eigen::Vector3d> r =
      force_residual(inputs.model_for(track), inputs.kinds, inputs.rules, track);
  FlightError error;
  error.path = track.path;
  error.force = error_of(track, r);
  if (error.force.windows.empty()) return std::nullopt;
  error.places = place_residuals(track, r);
  if (measures_velocity(inputs.cache->log(track.path, inputs.map)->log))
    error.velocity = error_of(track, velocity_error(track));
  return error;
}

std::vector<FlightError> flight_errors(const Inputs& inputs, int jobs) {
  return over_tracks<FlightError>(inputs, jobs, [&](const Track& track, std::vector<FlightError>& errors) {
    if (std::optional<FlightError> error = flight_error(inputs, track)) errors.push_back(std::move(*error));
  });
}

std::optional<VelocityError> velocity_error(const std::vector<FlightError>& errors) {
  std::vector<Eigen::Vector4d> bias;
  std::vector<ErrorWindow> windows;
  for (const FlightError& error : errors) {
    if (error.velocity.windows.empty()) continue;
    bias.push_back(error.velocity.bias);
    windows.insert(windows.end(), error.velocity.windows.begin(), error.velocity.windows.end());
  }
  if (windows.empty()) return std::nullopt;
  return velocity_error(bias, windows);
}

}  // namespace swarmcert::residuals
