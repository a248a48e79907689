/// @file A declared truth: what the force on a vehicle really is, as far as a user says so.
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

/// Reads --truth and encloses its effects over the motions that the arguments state.
/// @throws UsageError for a --gap that is none; files::InputError for bad files.
Truth read_truth(const DisturbanceArguments& arguments, const Tracking& tracking);

/// f_hat - f_a: the truth's numbers, with the network's rate where `source` has one. Without a network f_hat is 0.
void add_truth(const Truth& truth, stability::DisturbanceSource& source);

files::Json truth_json(const Truth& truth);
void print_truth(const Truth& truth);

}  // namespace swarmcert::analysis
