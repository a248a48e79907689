/// @file Instrumental-variable check of an effect against closed-loop bias, with setpoints as instruments.
///
/// Thrust reacts to disturbances, so least squares mistake the reaction for a cause. Setpoints do not react: the
/// columns evaluated along the setpoints, as if vehicles followed them exactly, are instruments Z. With as many
/// instruments as columns, c = (Z'X)^-1 Z'r. Source: the instrumental-variable estimator; its comparison with least
/// squares is Hausman's test (1978), here with influences summed by block.
#pragma once

#include <vector>

#include "analysis/identification/refinement.h"

namespace swarmcert::identification {

/// Returns the track as commanded by the setpoints: position, velocity, and the thrust, attitude, roll rate and pitch
/// rate that would follow them. Heading and yaw rate stay as flown, because logs have no setpoints for them; neighbours
/// stay at their measured positions. Precondition: there are as many targets as instants.
std::vector<stability::Instant> as_commanded(const residuals::Track& track, double mass_kg);

/// One coefficient, estimated by both methods.
struct InstrumentedValue {
  double least_squares = 0, instrument = 0;
  Interval interval;        ///< 90 %, of `instrument`
  double difference_z = 0;  ///< difference of the estimates divided by its standard error

  /// Returns whether the instrument can distinguish the coefficient from zero.
  bool is_strong() const;
  /// Returns whether it is strong and shows that most of the coefficient is an artefact.
  bool contradicts() const;
  /// Returns the apparent bias of least squares: the part of the difference that exceeds its standard error. 0 if the
  /// instrument is weak.
  double bias() const;
};

/// Returns both estimates of all coefficients of `effects` together, without bounds, by effect; coefficients held at
/// zero are weak. Empty if a log has no setpoints or nothing moves.
std::vector<std::vector<InstrumentedValue>> instrument(const Passes& passes,
                                                       const std::vector<Candidate>& effects);

/// An effect whose shape is estimated as well.
struct InstrumentedShape {
  std::vector<InstrumentedValue> coefficients;
  std::vector<InstrumentedValue> shapes;  ///< by parameter; those held fixed are weak
};

/// Like instrument(), for coefficients and free shapes together, by one Gauss-Newton step from `refined`: a disturbance
/// that moves the vehicle biases the shape as well, and with a wrong shape both estimates of a coefficient are wrong.
/// Lags and delays keep their times. Empty if no shape is free.
std::vector<InstrumentedShape> instrument_with_shapes(const Passes& passes,
                                                      const std::vector<Refined>& refined);

/// Widens the intervals of `refined` by the bias of each value, and so that they include the instrument's intervals if
/// it is strong. For a lag, the uncertainty of the gain is applied to the time constant, because c (L_tau T - T) is
/// approximately L_(c tau) T - T. The lower end of a lag extends to what setpoints allow, whether strong or weak, if
/// that is less. A positive coefficient beside a free shape gets the upper end of an interval of its logarithm: f = a
/// exp(-(z - z0) / b) is observed only away from z0, so an error of b multiplies a.
/// @param checks, with_shapes of the same effects, see above; may be empty
void widen_by_bias(const std::vector<std::vector<InstrumentedValue>>& checks,
                   const std::vector<InstrumentedShape>& with_shapes, std::vector<Refined>& refined);

}  // namespace swarmcert::identification
