/// @file The motor lag in the labels of the published networks.
#pragma once

namespace swarmcert::residuals {

/// Fraction of the remaining distance to the commanded thrust that is covered per record.
inline constexpr double kPublishedLagPerRecord = 0.16;
/// Time constant of that lag at the 100 Hz of the published logs: 0.01 s / -log(1 - 0.16), s.
inline constexpr double kPublishedLag_s = 0.0573548;

}  // namespace swarmcert::residuals
