/// @file The motors' lag in the published networks' labels.
#pragma once

namespace swarmcert::residuals {

/// Share of the way to the commanded thrust that the thrust goes in one record.
inline constexpr double kPublishedLagPerRecord = 0.16;
/// The time constant of that lag at the published logs' 100 Hz: 0.01 s / -log(1 - 0.16), s.
inline constexpr double kPublishedLag_s = 0.0573548;

}  // namespace swarmcert::residuals
