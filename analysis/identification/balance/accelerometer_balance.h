/// @file The accelerometer against the velocity: a scale error shows without any model of the vehicle.
///
/// Over a second the mean specific force is the change of the velocity plus gravity, whatever pushes the vehicle. Means
/// of blocks of 1 s are regressed on it: y = s x says a scale, y = x + b an offset. In slow flight both say the same.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/balance/mean_fit.h"
#include "analysis/residuals/inputs.h"

namespace swarmcert::identification {

/// Scale errors below this are those of accelerometers as they are sold, and of the gravity taken for them.
inline constexpr double kOrdinaryScaleError = 0.03;

inline constexpr char kAccelerometerScale[] = "accelerometer_scale";

struct AccelerometerBalance {
  std::string kind, vehicle;
  int flights = 0;
  std::size_t blocks = 0;
  MeanFit scale;  ///< measured over what the model says of the sensor; 1: the model is right
  /// Largest error of `scale` that a lag of the sensor makes while the body turns back and forth.
  double of_lag = 0;
  double z = 0;              ///< of the scale over an offset along the vertical, by the squares of the blocks
  double rmse_before_N = 0;  ///< mean disagreement of the blocks, times the mass
  double rmse_after_N = 0;
  bool is_named = false;

  /// An offset of the accelerometer along the vertical says the same on these flights.
  bool may_be_offset() const;
};

/// What the model's accelerometer_scale effects say of `vehicle`: the product of their scales.
double modelled_accelerometer_scale(const stability::Model& model, const std::string& vehicle);

/// Every vehicle of `kind` whose logs have an accelerometer and a velocity, over all of its flights; fewer than 10
/// blocks are left out. The model's own accelerometer_scale is taken out. Does not depend on `jobs`.
std::vector<AccelerometerBalance> accelerometer_balances(const residuals::Inputs& inputs,
                                                         const std::string& kind, int jobs);

/// accelerometer_scale with the number of `balance` and its interval, for its vehicle.
stability::EffectSpec spec_of(const AccelerometerBalance& balance);

/// "the accelerometer reads 1.080 times what the velocity says (90 %: 1.078 .. 1.082)".
std::string in_words(const AccelerometerBalance& balance);

}  // namespace swarmcert::identification
