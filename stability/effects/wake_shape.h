/// @file Shape limits of wakes, shared by the effects and by their enclosures.
#pragma once

namespace swarmcert::stability {

/// Distance along the wake at which amplitudes are stated.
inline constexpr double kWakeReference_m = 0.3;
/// Nearer than this a wake is taken as there: no fit reaches nearer.
inline constexpr double kWakeNearest_m = 0.12;
/// Nearer than this there is none.
inline constexpr double kWakeTouching_m = 0.05;
/// Mass of the vehicle that amplitudes are stated for.
inline constexpr double kWakeReferenceMass_kg = 0.034;
/// Beyond this many spreads the Gaussian, 2e-11, is taken as zero.
inline constexpr double kWakeReachInSpreads = 7;

}  // namespace swarmcert::stability
