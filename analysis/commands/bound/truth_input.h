/// @file A declared truth: the true force on a vehicle, as far as the user states it.
#pragma once

#include <string>
#include <vector>

#include "analysis/commands/shared/tracking_input.h"
#include "stability/bounds/truth_bounds.h"

namespace swarmcert::analysis {

struct DisturbanceArguments;

struct Truth {
  std::string path;
  stability::MotionSet motion;
  std::vector<stability::EffectBounds> effects;
};

/// Reads --truth and encloses its effects over the motions stated by the arguments.
/// @throws UsageError for an invalid --gap; files::InputError for invalid files.
Truth read_truth(const DisturbanceArguments& arguments, const Tracking& tracking);

/// Adds f_hat - f_a: the bounds of the truth, plus the rate of the network if `source` has one. Without a network
/// f_hat is 0.
void add_truth(const Truth& truth, stability::DisturbanceSource& source);

void describe(files::Record& record, const Truth& truth);
void print(const Truth& truth);

}  // namespace swarmcert::analysis
