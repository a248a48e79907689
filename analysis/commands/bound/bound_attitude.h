/// @file The position loop around the attitude loop that flies, for bound and tune: `--attitude-gains KR,Kw,KI`, else
/// [attitude] of gains.toml.
#pragma once

#include <string>

#include "analysis/commands/shared/tracking_input.h"
#include "stability/bounds/attitude_cascade.h"

namespace swarmcert::analysis {

/// Whether either says them; those of gains.toml only where both axes have loops of their own.
bool has_attitude_gains(const Tracking& input, const std::string& words);

/// The cascade of a horizontal axis. Motor lag and lag of the body rates are those of gains.toml, inertia and thrust
/// ratio those of the model; the attitude lag of gains.toml is what the attitude loop stands for and is left out.
/// @param words KR in N m, Kw in N m s, KI in N m/s: three numbers; empty: those of gains.toml, which must have them.
/// @throws UsageError for others, and for gains without a loop per axis.
stability::Cascade attitude_cascade(const Tracking& input, const std::string& words, int axis);

/// Per horizontal axis: exact gains for a force, an error of the estimated velocity and a torque, and how far the loop
/// is from a limit cycle. As attitude_cascade().
files::Json attitude_json(const Tracking& input, const std::string& words);
void print_attitude(const files::Json& attitude);

}  // namespace swarmcert::analysis
