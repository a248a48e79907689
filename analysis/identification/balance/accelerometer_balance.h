/// @file Compares the accelerometer with the velocity, which shows a scale error without any model of the vehicle.
///
/// Over a second the mean specific force equals the change of the velocity plus gravity, whatever forces act on the
/// vehicle. Means over blocks of 1 s are regressed on it: y = s x indicates a scale, y = x + b an offset. In slow
/// flight both explain the data equally well.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/balance/mean_fit.h"
#include "analysis/residuals/inputs.h"

namespace swarmcert::identification {

/// Scale errors below this are normal for commercial accelerometers and for the assumed value of gravity.
inline constexpr double kOrdinaryScaleError = 0.03;

struct AccelerometerBalance {
  std::string kind, vehicle;
  int flights = 0;
  std::size_t blocks = 0;
  MeanFit scale;  ///< measured over modelled scale; 1: the model is right
  /// Largest error of `scale` caused by a lag of the sensor while the body rotates back and forth.
  double of_lag = 0;
  double z = 0;              ///< of the scale over a vertical offset, from the squared errors of the blocks
  double rmse_before_N = 0;  ///< mean discrepancy of the blocks, times the mass
  double rmse_after_N = 0;
  bool is_named = false;

  /// Returns true if a vertical offset of the accelerometer explains these flights equally well.
  bool may_be_offset() const;
};

/// Returns whether the accelerometer explains a thrust_ratio of the force in flight, because it reads that much too
/// much: the difference is within both intervals and `of_lag`, and velocities surely show an error beyond that of the
/// assumed gravity, however ordinary it is for an accelerometer. A flawless vehicle would have such a ratio.
/// @param half of the ratio's 90 % interval
bool explains_ratio(const AccelerometerBalance& balance, double ratio, double half);

/// Returns the product of the scales of the model's accelerometer_scale effects for `vehicle`.
double modelled_accelerometer_scale(const stability::Model& model, const std::string& vehicle);

/// Returns the balance of each vehicle of `kind` whose logs have an accelerometer and a velocity, over all of its
/// flights. Vehicles with fewer than 10 blocks are skipped. The model's own accelerometer_scale is removed first. The
/// result does not depend on `jobs`.
std::vector<AccelerometerBalance> accelerometer_balances(const residuals::Inputs& inputs,
                                                         const std::string& kind, int jobs);

/// Returns the effect with the value and interval of `balance`, for its vehicle.
stability::EffectSpec spec_of(const AccelerometerBalance& balance);

/// Describes the balance: "the accelerometer reads 1.080 times what the velocity says (90 %: 1.078 .. 1.082)".
std::string in_words(const AccelerometerBalance& balance);

}  // namespace swarmcert::identification
