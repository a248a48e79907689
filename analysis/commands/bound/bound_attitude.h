/// @file The position loop around the attitude loop, in results and text; the option `--attitude-gains KR,Kw,KI`.
#pragma once

#include <string>
#include <vector>

#include "analysis/commands/shared/tracking_input.h"
#include "nn/base/record.h"
#include "stability/bounds/around_attitude.h"

namespace swarmcert::stability {

void describe(files::Record& record, const AttitudeRow& row);

}  // namespace swarmcert::stability

namespace swarmcert::analysis {

/// Declares --attitude-gains.
void declare_attitude(CLI::App& app, std::string& words);

/// Sets the attitude gains about the horizontal axes to those of the option, if it is given.
/// @param words KR in N m, Kw in N m s, KI in N m/s.
/// @throws UsageError for any other `words`.
void state_attitude_gains(const std::string& words, Tracking& input);

void print(const std::vector<stability::AttitudeRow>& attitude);

}  // namespace swarmcert::analysis
