/// @file Candidate effects with the shape parameters to try.
#pragma once

#include <string>
#include <vector>

#include "analysis/residuals/inputs.h"
#include "nn/base/interval.h"
#include "stability/effects/effect.h"

namespace swarmcert::identification {

/// An effect that may be missing, with the thetas to try.
struct Candidate {
  std::string name;
  stability::EffectSpec spec;  ///< as the model file would name it, without values
  stability::EffectInfo info;  ///< coefficients per vehicle where `vehicles` names some: "cf50.force_x_N"
  std::vector<std::vector<double>> thetas;
  std::vector<std::string> vehicles = {};  ///< each has coefficients of its own; empty: all have the same
  std::size_t refined_thetas = 0;          ///< so many at the end of `thetas` come from a refinement
  /// Of a lag or delay of the thrust, which the model's own thrust_ratio c acts on: 1 + c, a factor of its column.
  double scale = 1;

  int columns() const { return static_cast<int>(info.linear.size()); }
};

/// Fewer blocks of 2 s give no answer.
inline constexpr std::size_t kFewestBlocks = 10;

/// What the flights of one kind of vehicle cover.
struct Coverage {
  stability::FlightRange range;
  double height_span_m = 0;  ///< the most that one vehicle moved up and down in one flight
  int most_neighbours = 0;
  std::size_t records = 0;
  std::size_t blocks = 0;             ///< of cut_into_blocks()
  std::vector<std::string> vehicles;  ///< of the kind that flew, without those used for their position only
  std::vector<std::string>
      problems;  ///< logs of any kind that could not be read, and what is damaged in others

  /// Why these flights are too few for an answer; empty if they are not.
  std::string too_poor() const;
};

/// Coverage of the flights `which` (indices into inputs.found.flights) by vehicles of `kind`.
Coverage coverage(const residuals::Inputs& inputs, const std::string& kind, const std::vector<int>& which,
                  int jobs);

/// Every effect of the registry that a force can reveal, with its grid fitted to the coverage, and those that the
/// model file defines by formulas. Of the ceiling only thetas that a flight comes away from. Effects of neighbours are
/// left out where nobody has one, lags and delays where `model` has them; deep sets always, because a network must be
/// named; those of needs_scan() and the pendulum
/// where `model` has none. Where several vehicles flew, also a constant force of each.
std::vector<Candidate> all_candidates(const stability::Model& model, const Coverage& coverage);

/// One candidate by name. Of an effect that `model` has already, the candidate is a change of its coefficients; of a
/// formula whose coefficients are all zero in `model`, the formula with all its thetas.
/// @param name "constant_force" or another, "vehicle_offset" for a constant force of each vehicle.
/// @throws std::invalid_argument if there is none.
Candidate candidate(const std::string& name, const stability::Model& model, const Coverage& coverage);

/// Whether an effect of this name cannot be fitted to the force of a flight: it acts as a torque, or is a network.
bool is_written_by_hand(const std::string& name);

/// Fitted to the loads of the rotors in slow flight (rotors/rotor_fit.h); the force of a flight shows their sum only.
inline constexpr char kRotorThrust[] = "rotor_thrust";

/// Names that candidate() knows for `model`.
std::vector<std::string> candidate_names(const stability::Model& model);

/// True for lags and delays that `model` has: a second one cannot be written as a change of the first.
bool is_taken(const std::string& name, const stability::Model& model);

/// Sum of the excesses over 1 of the thrust ratios that the model has.
double own_thrust_ratio(const stability::Model& model);

/// True for a coefficient that is left out.
inline bool is_held_at_zero(const stability::Parameter& coefficient) {
  return coefficient.lower == 0 && coefficient.upper == 0;
}

/// A lag or delay of the thrust, and a thrust_ratio, by their places in a list of effects.
struct ScaledStage {
  std::size_t stage, scale;
};
/// The ratio acts on the thrust behind the lag: (1 + c) L T = T + c T + (1 + c) (L T - T). Where a column of c stands,
/// that of the lag, over Candidate::scale, goes with it.
std::vector<ScaledStage> scaled_stages(const std::vector<const Candidate*>& effects);

/// A lag or delay whose gain would be further from 1 than this is something else.
inline constexpr double kMemoryTolerance = 0.3;

/// The name under which candidate() gives each vehicle a constant force of its own.
inline constexpr char kVehicleOffset[] = "vehicle_offset";

/// `spec` of `candidate` with these numbers; several where each vehicle has its own.
std::vector<stability::EffectSpec> specs_of(const Candidate& candidate,
                                            const std::vector<double>& coefficients,
                                            const std::vector<double>& theta,
                                            const std::vector<Interval>& linear_intervals,
                                            const std::vector<Interval>& shape_intervals);

/// `model` with `specs`; an effect that the model has already is increased instead.
stability::Model with_effects(const stability::Model& model, const std::vector<stability::EffectSpec>& specs);

}  // namespace swarmcert::identification
