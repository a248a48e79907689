/// @file Effects that turn a vehicle, fitted to predictions of its attitude.
///
/// Logged torques of rotors are noisy, and the attitude loop reacts to what they lack: a regression of omega' on them
/// understates every gain, and what multiplies the rates or the velocity takes over what is missing. Here the model is
/// integrated from measured states (analysis/residuals/prediction.h), with the means of two records between them, and
/// the coefficients c minimise
///   sum_(starts, steps h) rho(|omega_h(c) - omega_h| / s_omega) + rho(|theta_h(c)| / s_theta),
/// with theta_h the rotation from the measured to the predicted attitude, s the root mean square of these errors if
/// nothing changes over the horizon, and rho Huber's loss. They predict best over the horizon from such signals; they
/// have no interval, because noise of the signals reduces them: they are effective values.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "analysis/residuals/inputs.h"
#include "stability/model.h"

namespace swarmcert::identification {

/// Returns the registered effects that are fitted in this way, see is_turning().
std::vector<std::string> turning_effects();
/// Returns one of them with all coefficients zero.
stability::EffectSpec turning_effect(const std::string& name);

/// Means over a track: of the absolute error about x, y, z, and of the norm of the error.
struct RateErrors {
  std::array<double, 4> rad_s = {0, 0, 0, 0};
  double norm_rad_s() const { return rad_s[3]; }
};

/// Flights from which attitudes can be predicted: with rates, and with measured rotor speeds or the force of each rotor
/// at the rate of an attitude loop.
class TurningFlights {
 public:
  /// @param inputs with the model whose forces move the vehicles
  /// @param which flights of `inputs`
  TurningFlights(const residuals::Inputs& inputs, const std::string& kind, const std::vector<int>& which,
                 int jobs);

  bool empty() const { return tracks_.empty(); }

  /// Returns the mean errors of the body rates over half a second, for each track, of the models with `specs` added.
  std::vector<RateErrors> rate_errors(const std::vector<stability::EffectSpec>& specs) const;

  /// Returns the same if the rates do not change.
  std::vector<RateErrors> held() const;

  /// Returns `specs`, effects of this kind, with all their coefficients fitted jointly, from their values on.
  std::vector<stability::EffectSpec> fitted(const std::vector<stability::EffectSpec>& specs) const;

 private:
  struct TurningTrack {
    residuals::Track track;
    stability::Model model;
    std::vector<std::size_t> starts;   ///< of predictions
    std::size_t steps;                 ///< of each
    double rates_rad_s, rotation_rad;  ///< s_omega and s_theta
    RateErrors held;
  };
  struct NormalEquations;
  void set_scales(TurningTrack& t) const;
  NormalEquations normal_equations(const TurningTrack& t, const std::vector<stability::EffectSpec>& specs,
                                   bool with_slopes) const;
  std::vector<NormalEquations> of_all(const std::vector<stability::EffectSpec>& specs,
                                      bool with_slopes) const;

  residuals::Kinds kinds_;
  int jobs_;
  std::vector<TurningTrack> tracks_;
};

}  // namespace swarmcert::identification
