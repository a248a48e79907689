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
  stability::EffectSpec spec;  ///< as in the model file, without values
  stability::EffectInfo info;  ///< per-vehicle coefficients ("cf50.force_x_N") if `vehicles` is not empty
  std::vector<std::vector<double>> thetas;
  std::vector<std::string> vehicles = {};  ///< vehicles with their own coefficients; empty: shared by all
  /// For a lag or delay of the thrust: the factor 1 + c of its column, where c is the model's own thrust_ratio.
  double scale = 1;

  int columns() const { return static_cast<int>(info.linear.size()); }
};

/// With fewer blocks of 2 s no answer is given.
inline constexpr std::size_t kFewestBlocks = 10;

/// What the flights of one kind of vehicle cover.
struct Coverage {
  stability::FlightRange range;
  double battery_most_V = 0;
  double height_span_m = 0;  ///< largest height range of a vehicle in one flight
  int most_neighbours = 0;
  bool has_set_points = false;  ///< in at least one log
  std::size_t records = 0;
  std::size_t blocks = 0;             ///< of cut_into_blocks()
  std::vector<std::string> vehicles;  ///< of the kind that flew, without position-only vehicles
  std::vector<std::string> problems;  ///< logs of any kind that could not be read, and damage in others

  /// Returns why these flights are too few for an answer; empty if they are sufficient.
  std::string too_poor() const;
};

/// Returns the coverage of the flights `which` (indices into inputs.found.flights) by vehicles of `kind`.
Coverage coverage(const residuals::Inputs& inputs, const std::string& kind, const std::vector<int>& which,
                  int jobs);

/// Returns all effects of the registry that a force can reveal, with grids adapted to the coverage, and those that the
/// model file defines by formulas. A ceiling is included only with thetas whose region a flight
/// leaves. Not included
/// are effects of neighbours if no vehicle has one, lags and delays that `model` already has, deep sets (which need a
/// network), and effects of needs_scan() and swings() unless `model` has them. If several vehicles flew, a constant
/// force per vehicle is included.
std::vector<Candidate> all_candidates(const stability::Model& model, const Coverage& coverage);

/// Returns a single candidate by name. If `model` already has the effect, the candidate is a change of its
/// coefficients; for a formula whose coefficients in `model` are all zero, it is the formula with all its thetas.
/// @param name name of an effect, or "vehicle_offset" for a constant force per vehicle
/// @throws std::invalid_argument if there is none.
Candidate candidate(const std::string& name, const stability::Model& model, const Coverage& coverage);

/// Returns true if an effect of this name cannot be fitted to the force in flight: it acts as a torque or is a network.
bool is_written_by_hand(const std::string& name);

/// Returns true for effects that are fitted to predictions of the attitude (turning.h).
bool is_turning(const std::string& name);

/// Returns the effect of single rotors. It is fitted to their loads in slow flight (rotors/rotor_fit.h), as the
/// force in flight shows only their sum.
std::string rotor_effect();

/// Returns the names that candidate() accepts for `model`.
std::vector<std::string> candidate_names(const stability::Model& model);

/// Returns true for lags and delays that `model` has, because a second one cannot be written as a change of the first.
bool is_taken(const std::string& name, const stability::Model& model);

/// Returns whether an effect is a constant fraction of the thrust.
bool is_plain_scale(const std::string& effect);

/// Returns the sum of the excesses over 1 of the model's thrust ratios.
double own_thrust_ratio(const stability::Model& model);

/// Returns true for a coefficient that is excluded from the fit.
inline bool is_held_at_zero(const stability::Parameter& coefficient) {
  return coefficient.lower == 0 && coefficient.upper == 0;
}

/// A lag or delay of the thrust and a thrust_ratio, by their indices in a list of effects.
struct ScaledStage {
  std::size_t stage, scale;
};
/// Returns the pairs. The ratio acts on the thrust after the lag: (1 + c) L T = T + c T + (1 + c) (L T - T). Wherever
/// the column of c occurs, that of the lag, divided by Candidate::scale, is added.
std::vector<ScaledStage> scaled_stages(const std::vector<const Candidate*>& effects);

/// A lag or delay with a gain further from 1 than this is really another effect.
inline constexpr double kMemoryTolerance = 0.3;

/// The name for which candidate() returns a constant force per vehicle.
inline constexpr char kVehicleOffset[] = "vehicle_offset";

/// Returns `spec` of `candidate` with these values; several specs if vehicles have their own coefficients.
std::vector<stability::EffectSpec> specs_of(const Candidate& candidate,
                                            const std::vector<double>& coefficients,
                                            const std::vector<double>& theta,
                                            const std::vector<Interval>& linear_intervals,
                                            const std::vector<Interval>& shape_intervals);

/// Returns `model` with `specs` added; an effect that the model already has is increased instead.
stability::Model with_effects(const stability::Model& model, const std::vector<stability::EffectSpec>& specs);

}  // namespace swarmcert::identification
