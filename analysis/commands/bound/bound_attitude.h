/// @file The position loop around the attitude loop, for bound and tune: `--attitude-gains KR,Kw,KI`, or [attitude]
/// of
/// gains.toml.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "analysis/commands/shared/tracking_input.h"
#include "nn/base/record.h"
#include "stability/bounds/loops/coupled_cascade.h"

namespace swarmcert::analysis {

/// Whether the option (`words`) or gains.toml states attitude gains.
bool has_attitude_gains(const Tracking& input, const std::string& words);

/// Returns the cascade of a horizontal axis. The lags of the motors and of the body rates are those of gains.toml,
/// the inertia and the thrust ratio those of the model. The attitude lag of gains.toml is left out: the attitude loop
/// takes its place.
/// @param words KR in N m, Kw in N m s, KI in N m/s: three numbers; if empty, gains.toml must state them.
/// @throws UsageError for any other `words`, and for an axis that Lambda or K couples to others.
stability::Cascade attitude_cascade(const Tracking& input, const std::string& words, int axis);

/// The same for axes coupled by Lambda or K, in ascending order; z has thrust dynamics but no attitude law.
/// @throws UsageError for any other `words`.
stability::CoupledCascade coupled_attitude_cascade(const Tracking& input, const std::string& words,
                                                   const std::vector<int>& axes);

/// Exact gains of the cascade of one axis, per unit of one disturbance.
struct CascadeGains {
  stability::ResponseNorms force, velocity_error, torque;
};

/// How far the loop of an axis, or of all coupled axes as one, is from a limit cycle.
struct AttitudeRow {
  std::vector<int> axes;
  stability::CascadeMargins margins;
  stability::Nearness nearness = stability::Nearness::kUnstable;
  std::optional<CascadeGains> exact;  ///< of a single axis
  std::vector<stability::CascadeMargins>
      alone;  ///< of coupled axes: where the gain or the delay of one changes
};
void describe(files::Record& record, const AttitudeRow& row);

/// Returns one row per decoupled horizontal axis with its exact gains for a force, an error of the estimated velocity
/// and a torque, and one row without gains for all coupled axes. Parameters and exceptions as in attitude_cascade().
std::vector<AttitudeRow> attitude_rows(const Tracking& input, const std::string& words);
void print(const std::vector<AttitudeRow>& attitude);

}  // namespace swarmcert::analysis
