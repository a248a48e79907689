/// @file All bounds on the tracking error of given gains on a given vehicle.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "stability/bounds/disturbance_source.h"
#include "stability/bounds/flown_loop.h"
#include "stability/bounds/loops/vector_gain.h"
#include "stability/bounds/saturation.h"
#include "stability/bounds/theorem.h"

namespace swarmcert::stability {

enum class Loop { kContinuous, kSampled };

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
/// @param of the gains of the row: its axis, channel and loop.
/// @throws std::invalid_argument if the loop has no such axis.
AxisBounds axis_bounds(const FlownLoop& loop, const ExactGains& of, const DisturbanceSource& source,
                       const InitialError& initial);
/// Returns the gains of one axis and channel of the loop that flies.
ExactGains flown_gains(const FlownLoop& loop, int axis, Channel channel);

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

/// Name of the assumption on which only the bounds of the continuous loop rest.
inline constexpr char kContinuousLoop[] = "continuous position loop";

struct Assumption {
  std::string name;
  std::string status;  ///< "proved", "measured", "assumed", or "refuted" with the counterexample in the note
  std::string note;
};

struct TrackingReport {
  Theorem theorem;
  std::optional<double> ball_m;        ///< if the theorem applies and d_m bounds the learning error
  std::optional<double> flown_ball_m;  ///< the same of the loop that flies: flown_ball_per_rate()
  std::optional<Transient> transient;
  std::vector<ExactGains> exact;
  std::vector<EstimateGains> of_estimates;
  std::vector<AxisBounds> bounds;
  std::vector<AxisFacts> facts;
  std::optional<VectorGain> vector;
  std::optional<bool> is_stable;  ///< of the loop that flies
  Saturation saturation;          ///< every bound of the loop is subject to it
  std::vector<Assumption> assumptions;
};

TrackingReport tracking_bounds(const FlownLoop& loop, const DisturbanceSource& source,
                               const InitialError& initial);

/// "x", "y", "z"; "force", "command"; "velocity", "position"; "continuous", "sampled".
const char* axis_name(int axis);
/// Returns the axis of a name that axis_name() gives.
/// @throws std::invalid_argument for any other name.
int axis_of_name(const std::string& name);
const char* name(Channel channel);
const char* name(Estimate estimate);
const char* name(Loop loop);

}  // namespace swarmcert::stability
