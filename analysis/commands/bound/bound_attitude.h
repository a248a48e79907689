/// @file The position loop around the attitude loop that flies, for bound and tune: `--attitude-gains KR,Kw,KI`, else
/// [attitude] of gains.toml.
#pragma once

#include <string>
#include <vector>

#include "analysis/commands/shared/tracking_input.h"
#include "stability/bounds/loops/coupled_cascade.h"

namespace swarmcert::analysis {

/// Whether either says them.
bool has_attitude_gains(const Tracking& input, const std::string& words);

/// The cascade of a horizontal axis. Motor lag and lag of the body rates are those of gains.toml, inertia and thrust
/// ratio those of the model; the attitude lag of gains.toml is what the attitude loop stands for and is left out.
/// @param words KR in N m, Kw in N m s, KI in N m/s: three numbers; empty: those of gains.toml, which must have them.
/// @throws UsageError for others, and for an axis that Lambda or K couples to others.
stability::Cascade attitude_cascade(const Tracking& input, const std::string& words, int axis);

/// The same for axes that Lambda or K couples, in ascending order; z has a thrust, but no attitude law.
/// @throws UsageError for other words.
stability::CoupledCascade coupled_attitude_cascade(const Tracking& input, const std::string& words,
                                                   const std::vector<int>& axes);

/// How far the loop is from a limit cycle. A row per horizontal axis with a loop of its own, with its exact gains for a
/// force, an error of the estimated velocity and a torque; one row for the axes that are coupled, which has none.
/// As attitude_cascade().
files::Json attitude_json(const Tracking& input, const std::string& words);
void print_attitude(const files::Json& attitude);

}  // namespace swarmcert::analysis
