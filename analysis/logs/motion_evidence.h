/// @file What must hold between the signals of a flight, in bits of evidence.
///
/// Each relation compares two series that should be equal up to noise. With the variances of both, the mean square
/// difference and a tolerance s, n independent samples give n/2 log2((min variance + s^2) / (difference + s^2)) bits:
/// many where the series agree and move, none where both are at rest, negative where they contradict each other.
#pragma once

#include "analysis/logs/readings.h"

namespace swarmcert::logs {

/// Bits that a velocity is the derivative of a position: dp/dt = v. Set points and other vehicles have velocities too:
/// at most 10 per axis.
double derivative_bits(const Knots& knots, const Reading& position, const Reading& velocity);

/// Returns the acceleration in W, m/s^2: the slope of a velocity, or the curvature of a position.
ThreeSeries acceleration_of(const Knots& knots, const Reading& motion);

/// Bits that rotors push along the body's z axis: (a_x, a_y) = (R13, R23) / R33 (a_z + g).
double thrust_axis_bits(const Knots& knots, const ThreeSeries& acceleration, const Reading& attitude);

/// Bits that an accelerometer measures dv/dt = R f - g, or f - g in the world. Without an attitude, only that the
/// vertical part agrees.
double specific_force_bits(const Knots& knots, const ThreeSeries& acceleration, const Reading* attitude,
                           const Reading& force);

/// Bits that the body rates are those of the attitude: w = 2 q* dq/dt. Other derivatives agree as well: at most 15 per
/// axis.
double rate_bits(const Knots& knots, const Reading& attitude, const Reading& rates);

/// Bits that, where no attitude is known, the body rates turn the thrust axis as the acceleration asks: with the yaw
/// psi integrated from w_z and its best start, w_y - i w_x = exp(-i psi) d/dt (a_x + i a_y) / (a_z + g).
double tilt_rate_bits(const Knots& knots, const ThreeSeries& acceleration, const Reading& rates);

/// Bits that two positions or two velocities follow each other.
double following_bits(const Knots& knots, const Reading& a, const Reading& b);

}  // namespace swarmcert::logs
