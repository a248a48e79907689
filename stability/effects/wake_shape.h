/// @file Shape limits of wakes, shared by the effects and by their enclosures.
#pragma once

namespace swarmcert::stability {

/// Distance along the wake to which amplitudes refer.
inline constexpr double kWakeReference_m = 0.3;
/// Closer distances are replaced by this one, as no fit covers them.
inline constexpr double kWakeNearest_m = 0.12;
/// At this distance and below there is no wake: the vehicles touch.
inline constexpr double kWakeTouching_m = 0.05;
/// Mass of the vehicle to which amplitudes refer.
inline constexpr double kWakeReferenceMass_kg = 0.034;
/// Beyond this many spreads the Gaussian, below 2e-11 there, is set to zero.
inline constexpr double kWakeReachInSpreads = 7;

}  // namespace swarmcert::stability
