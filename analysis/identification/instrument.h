/// @file Instrumental-variable check of an effect against closed-loop bias; the set points are the instruments.
///
/// Thrust answers disturbances, so that least squares mistakes the answer for a cause. Set points do not answer: the
/// columns along the set points, as if vehicles followed them exactly, are instruments Z. With as many instruments as
/// columns, c = (Z'X)^-1 Z'r. Source: the instrumental-variable estimator; its comparison with least squares is
/// Hausman's test 1978, here with influences summed by block.
#pragma once

#include <vector>

#include "analysis/identification/refinement.h"

namespace swarmcert::identification {

/// The track as set points ask for it: position, velocity, and the thrust, the attitude, the roll rate and the pitch
/// rate that would follow them. Heading and yaw rate stay as flown, because logs have no set point for them; neighbours
/// stay where they were seen. Precondition: as many targets as instants.
std::vector<stability::Instant> as_commanded(const residuals::Track& track, double mass_kg);

/// One coefficient by both estimators.
struct InstrumentedValue {
  double least_squares = 0, instrument = 0;
  Interval interval;        ///< 90 %, of `instrument`
  double difference_z = 0;  ///< their difference over its standard error

  /// The instrument can tell the coefficient from none at all.
  bool is_strong() const;
  /// ... and says that most of it is not there.
  bool contradicts() const;
  /// How far least squares seems to be off: what of the difference is more than its standard error. 0 where the
  /// instrument is weak.
  double bias() const;
};

/// Both estimates of all coefficients of `effects` together, without bounds, effect by effect; those that are held at
/// zero are weak. Empty where a log has no set points, or nothing moves.
std::vector<std::vector<InstrumentedValue>> instrument(const Passes& passes,
                                                       const std::vector<Candidate>& effects);

/// An effect whose shape is estimated as well.
struct InstrumentedShape {
  std::vector<InstrumentedValue> coefficients;
  std::vector<InstrumentedValue> shapes;  ///< by parameter; those that were held are weak
};

/// As instrument(), of coefficients and free shapes together, one Gauss-Newton step from `refined`: a disturbance that
/// moves the vehicle bends the shape as well, and a coefficient beside a wrong shape is wrong by both estimators. Lags
/// and delays keep their times. Empty where no shape is free.
std::vector<InstrumentedShape> instrument_with_shapes(const Passes& passes,
                                                      const std::vector<Refined>& refined);

/// Widens the intervals of `refined` by the bias of each number, and so that they hold the instrument's where that is
/// strong; what concerns a lag's gain falls on its time, since c (L_tau T - T) is about (L_(c tau) T - T). A lag
/// reaches down to what set points leave possible, weak or not, where they say less. A positive
/// coefficient beside a free shape gets the upper end of an interval of its logarithm: f = a exp(-(z - z0) / b) is seen
/// away from z0 only, so that an error of b multiplies a.
/// @param checks, with_shapes of the same effects, see above; may be empty.
void widen_by_bias(const std::vector<std::vector<InstrumentedValue>>& checks,
                   const std::vector<InstrumentedShape>& with_shapes, std::vector<Refined>& refined);

}  // namespace swarmcert::identification
