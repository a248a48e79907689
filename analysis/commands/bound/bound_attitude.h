/// @file `--attitude-gains KR,Kw,KI` of bound and tune: the position loop around the attitude loop that flies.
#pragma once

#include <string>

#include "analysis/commands/shared/tracking_input.h"
#include "stability/bounds/attitude_cascade.h"

namespace swarmcert::analysis {

/// The cascade of a horizontal axis. Motor lag of gains.toml, inertia and thrust ratio of the model; the attitude lag of
/// gains.toml is what the attitude loop stands for and is left out.
/// @param words KR in N m, Kw in N m s, KI in N m/s: three numbers. @throws UsageError for others, and for gains without
///   a loop per axis.
stability::Cascade attitude_cascade(const Tracking& input, const std::string& words, int axis);

/// Per horizontal axis: exact gains for a force, an error of the estimated velocity and a torque, and how far the loop is
/// from a limit cycle. As attitude_cascade().
files::Json attitude_json(const Tracking& input, const std::string& words);
void print_attitude(const files::Json& attitude);

}  // namespace swarmcert::analysis
