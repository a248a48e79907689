/// @file All bounds on the tracking error of given gains on a given vehicle.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "stability/bounds/disturbance_bounds.h"
#include "stability/bounds/loops/sampled_loop.h"
#include "stability/bounds/loops/vector_gain.h"
#include "stability/bounds/theorem.h"
#include "stability/gains.h"

namespace swarmcert::stability {

enum class Loop { kContinuous, kSampled };

/// The parameters of the vehicle that the bounds use.
struct Plant {
  double mass_kg = 0;
  double thrust_scale = 1;      ///< actual force per commanded force
  double largest_thrust_N = 0;  ///< of all rotors; 0: unknown
};

/// Returns the loop of one axis, with the lags of the thrust and, for x and y, of its direction. Returns nothing if
/// Lambda or K couples axes.
std::optional<AxisLoop> axis_loop(const Gains& gains, const Plant& plant, int axis);

/// Returns the same loop as the firmware runs it; nothing without rate_hz.
std::optional<SampledLoop> sampled_axis_loop(const Gains& gains, const Plant& plant, int axis);

/// Norms at t = 0.
struct InitialError {
  double position_m = 0;        ///< |e|
  double velocity_m_s = 0;      ///< |e'|
  double learning_error_N = 0;  ///< |force error|, bias included
};

/// Known bounds on the disturbances, per axis, and their source.
struct DisturbanceSource {
  Disturbance axis[3];
  double rate_norm_N_s = std::numeric_limits<double>::infinity();  ///< d_m: sup |eps'| as a vector
  double bias_N[3] = {0, 0, 0};
  /// True if amplitude and impulse were measured with the bias included; otherwise the bias adds to every class.
  bool classes_contain_bias = false;
  EstimateError velocity_error[3];  ///< estimated - true velocity
  EstimateError position_error[3];  ///< estimated - true position
  ReferenceMotion reference[3];
  bool has_moving_reference() const;
  /// |d|: every rotor gives (1 + d) times the thrust of the model, with the same constant d; see thrust_ratio.h.
  double thrust_ratio_error = 0;
  bool declares_velocity_error = false;  ///< velocity_error was declared, not measured
  bool has_estimate_errors() const;
  /// Returns true if the amplitude is at least the bias on every axis, as it is if measured with the bias included.
  bool amplitudes_reach_bias() const;
  /// Returns all errors on an axis in addition to its class.
  OtherErrors other(int of_axis, const InitialError& initial, const Plant& plant) const;
  /// "declared", "declared truth", "measured" or "rate of f_hat". The last bounds only the learned force, not its
  /// error, and therefore gives no ball.
  std::string kind = "none";
  std::string note;                              ///< on the numbers, for the list of assumptions
  std::vector<std::string> further_assumptions;  ///< that the numbers rely on
  bool bounds_learning_error() const { return kind != "none" && kind != "rate of f_hat"; }
  double f_hat_rate_N_s = 0;  ///< sup |f_hat'|, for the staircase; valid if f_hat_rate_known
  bool f_hat_rate_known = false;
};

struct ExactGains {
  int axis = 0;
  Channel channel = Channel::kForce;
  Loop loop = Loop::kContinuous;
  GainNorms norms;      ///< sampled: at the sampling instants
  GainNorms all_times;  ///< sampled: also between them
};

/// Gains from errors of the estimates: norms per m/s for a velocity error, per m for a position error.
struct EstimateGains {
  int axis = 0;
  Estimate estimate = Estimate::kVelocity;
  Loop loop = Loop::kContinuous;
  GainNorms norms;      ///< sampled: at the sampling instants
  GainNorms all_times;  ///< sampled: also between them
};

/// Bounds of one axis. Each holds for all declared disturbances together, starting from rest except for the initial
/// error.
struct AxisBounds {
  int axis = 0;
  Channel channel = Channel::kForce;
  Loop loop = Loop::kContinuous;
  DisturbanceBounds bounds;  ///< of the linear loop, including `parts`: hold if clamp.never_acts
  ErrorParts parts;          ///< in addition to the class, of the linear loop
  ClampBounds clamp;
  /// Returns the smallest valid bound: of `bounds` if the clamp never acts, else of those that hold with a clamp.
  double least() const {
    const double clamped = clamp.by_amplitude < clamp.by_impulse ? clamp.by_amplitude : clamp.by_impulse;
    return clamp.never_acts && bounds.least() < clamped ? bounds.least() : clamped;
  }
  double staircase_m = 0;  ///< to be added for a learned force that is a staircase or delayed
  double float32_m = 0;    ///< to be added for float32 arithmetic, if known
  double total_m() const { return least() + staircase_m + float32_m; }
};

/// Returns the bounds of one axis without staircase and float32.
/// @param gains of the loop and channel, over all times.
/// @param known, other as given by the source.
AxisBounds axis_bounds(const AxisLoop& loop, Channel channel, const GainNorms& gains,
                       const Disturbance& known, const OtherErrors& other, bool classes_contain_bias,
                       double limit_m_s);
AxisBounds axis_bounds(const SampledLoop& loop, Channel channel, const GainNorms& gains,
                       const Disturbance& known, const OtherErrors& other, bool classes_contain_bias,
                       double limit_m_s);

struct AxisFacts {
  int axis = 0;
  bool stable = false;
  LagFloor lag_floor;
  double effort_gain = 0;
  double lag_limit_s = 0;
  double delay_limit_s = 0;
  double effective_Ki = 0;  ///< of the sampled loop, else as written
  double written_Ki = 0;
  double spectral_radius = 0;    ///< 0: no sampled loop
  double clamp_authority_N = 0;  ///< constant force that the integrator can cancel; infinite without a limit
  double clamp_residual_m = 0;   ///< of bias_N
  NoiseDeviation noise;          ///< for 1 mm and 0.05 m/s, sampled loop
};

struct Assumption {
  std::string name;
  std::string status;  ///< "proved", "measured" or "assumed"
  std::string note;
};

struct TrackingReport {
  Theorem theorem;
  std::optional<double> ball_m;  ///< if the theorem applies and d_m bounds the learning error
  std::optional<Transient> transient;
  std::vector<ExactGains> exact;
  std::vector<EstimateGains> of_estimates;
  std::vector<AxisBounds> bounds;
  std::vector<AxisFacts> facts;
  std::optional<VectorGain> vector;
  std::optional<double> thrust_margin_N;  ///< thrust_margin_N() of the z axis
  std::vector<Assumption> assumptions;
};

TrackingReport tracking_bounds(const Gains& gains, const Plant& plant, const DisturbanceSource& source,
                               const InitialError& initial);

/// Returns the margin to saturation about hover, N: the smaller of the thrust left up to the maximum and down to zero
/// under every disturbance of the source, by the effort gain of the continuous loop `vertical` of the z axis. Negative:
/// a disturbance of the source saturates the linear loop, so that its bounds do not hold. Nothing if the maximum
/// thrust or the amplitude is unknown, or the set point moves.
std::optional<double> thrust_margin_N(const Plant& plant, const AxisLoop& vertical,
                                      const DisturbanceSource& source, const InitialError& initial);

/// "x", "y", "z"; "force", "command"; "velocity", "position"; "continuous", "sampled".
const char* axis_name(int axis);
/// Returns the axis of a name that axis_name() gives.
/// @throws std::invalid_argument for any other name.
int axis_of_name(const std::string& name);
const char* name(Channel channel);
const char* name(Estimate estimate);
const char* name(Loop loop);

}  // namespace swarmcert::stability
