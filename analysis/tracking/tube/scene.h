/// @file Vehicles that fly a task with a network, in the world of a declared truth: what every tube about them rests
/// on.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "analysis/tracking/tube/hold_error.h"
#include "analysis/tracking/tube/learned_force.h"
#include "analysis/tracking/tube/motion.h"
#include "analysis/tracking/tube/residual_envelope.h"
#include "analysis/tracking/tube/truth_force.h"

namespace swarmcert::analysis {

/// How far each vehicle may be from its set point, axis by axis: |e| and |e'| of vehicle i are at most these.
struct Radii {
  std::vector<std::array<double, 3>> position_m, velocity_m_s;

  static Radii none(int vehicles);
  /// Whether every entry is at most `other`'s. False for NaN.
  bool within(const Radii& other) const;
  /// Whether every entry is below `other`'s. False for NaN.
  bool below(const Radii& other) const;
  Radii scaled(double factor, double more) const;  ///< factor x + more
  double largest_position_m(int axis) const;
  double largest_position_m() const;  ///< over all axes
};

Radii smaller(const Radii& a, const Radii& b);  ///< entry by entry
Radii larger(const Radii& a, const Radii& b);

/// Where one vehicle may be about its set point: e and e' lie in these.
struct Deviation {
  std::array<Interval, 3> position_m, velocity_m_s;
};
using Deviations = std::vector<Deviation>;  ///< of every vehicle

/// All that is within radii.
Deviations all_within(const Radii& radii);

/// The declared truth at the states of one stretch: f_a and how it changes.
struct TruthSizes {
  Interval force_N[3];
  double rest_width_N = 0;           ///< along z, of all but wakes: largest change within the tube
  std::vector<double> gradient_N_m;  ///< per neighbour, |d f_z / d p_j|; infinite where the field jumps
};

/// Makes `a` contain `b`.
void unite(TruthSizes& a, const TruthSizes& b);

/// The loops whose motors lag by what lies in a part of the interval of lags, and what the start of rotors does to z.
struct LagPart {
  ErrorLoops loops;
  LagStart start_z;
};

/// How old the states are, at most, that a prediction rests on when it acts: a period of the network and its latency,
/// and one of a sampled loop, which acts for that long on what it was told.
double network_age_s(const stability::Gains& gains, bool is_sampled = false);

class Scene {
 public:
  /// @param network_age_s how old the states are, at most, that a prediction rests on when it acts.
  /// @param is_sampled see error_loops().
  /// @param motor_lag_s see error_loops().
  /// @param estimates what is wrong with what every vehicle knows of itself and is told by others.
  /// @param residual what acts beside the truth's effects, where not null; must outlive this.
  /// @throws files::InputError as LearnedForce.
  Scene(const stability::TrackingSetup& tracking, const stability::Model& truth,
        const files::Network& network, const stability::Task& task, int vehicles, double network_age_s,
        double longest_slice_s = kSlice_s, bool is_sampled = false, const EstimateErrors& estimates = {},
        const std::optional<Interval>& motor_lag_s = {}, const ResidualEnvelope* residual = nullptr);

  const stability::TrackingSetup& tracking() const { return tracking_; }
  const LearnedForce& learned() const { return learned_; }
  const TruthForce& truth() const { return truth_; }
  const ResidualEnvelope* residual() const { return residual_; }  ///< null: there is none
  const Motion& motion() const { return motion_; }
  const ErrorLoops& loops() const { return loops_; }
  /// Parts that cover the interval of lags, none of which is wider than its kLagPart, unless there were too many.
  const std::vector<LagPart>& lag_parts() const { return lag_parts_; }
  double network_age_s() const { return network_age_s_; }
  Interval motor_lag_s() const { return motor_lag_s_; }
  bool has_lag_interval() const { return motor_lag_s_.lower < motor_lag_s_.upper; }
  const EstimateErrors& estimates() const { return estimates_; }
  /// What these do to each axis of every vehicle.
  const EstimateAnswer& estimate_answer(std::size_t axis) const { return estimate_answers_[axis]; }
  int vehicles() const { return motion_.vehicles; }
  /// Why nothing can be said; empty otherwise.
  std::string refusal() const;

  /// Every state that a vehicle can meet in a stretch while all are within `radii`.
  std::vector<Interval> states(const Stretch& stretch, const Deviations& deviations) const;
  /// The same states as the network is given them, with the errors of the estimates.
  std::vector<Interval> seen_states(const Stretch& stretch, const Deviations& deviations) const;
  /// True offsets of the neighbours, of `states` and of what these become within network_age_s.
  /// @param all the stretch's states: the velocities at which offsets may change.
  /// @param are_seen `states` are what the network was given.
  std::vector<Offset> offsets(const std::vector<Interval>& states, const std::vector<Interval>& all,
                              bool are_seen = false) const;
  /// The residual, which may change at any rate, included.
  TruthForce::Rest rest(const Stretch& stretch, const Deviations& deviations, double acceleration_m_s2) const;
  TruthSizes truth_sizes(const Stretch& stretch, const Deviations& deviations) const;
  std::vector<TruthSizes> truth_sizes(const Radii& radii) const;  ///< of every stretch

  /// Thrust beyond the weight at t = 0, N: rotors start anywhere between the weight and the force that the first
  /// prediction asks for.
  Interval excess_at_start_N(int vehicle) const { return excess_N_[static_cast<std::size_t>(vehicle)]; }

  /// Bounds of the errors of one vehicle that f_hat - f_a does not cause along z: the feed-forward's and the truth's
  /// lag, the rotors' start and errors of the estimates, and along x and y the truth itself.
  std::array<ErrorHistory, 3> other_errors(int vehicle, const std::vector<TruthSizes>& truth) const;
  /// What one axis adds to its history in one slice.
  LoopHistory in_slice(const Stretch& stretch, int slice, std::size_t axis, double force_N,
                       const TruthSizes& truth, double position_m, double velocity_m_s) const;
  /// hold_error_N() of a vehicle's axis.
  double hold_error_N(int vehicle, std::size_t axis, const LoopHistory& history) const;
  /// The same slice by slice while all are within `radii`. @param force_N of |f_hat - f_a| along z, per stretch.
  std::array<std::vector<double>, 3> hold_sizes_N(int vehicle, const Radii& radii,
                                                  const std::vector<double>& force_N,
                                                  const std::vector<TruthSizes>& truth) const;
  /// Bounds of the errors that hold_sizes_N() causes; nothing to add where the loop is continuous.
  std::array<ErrorHistory, 3> hold_errors(int vehicle, const Radii& radii, const std::vector<double>& force_N,
                                          const std::vector<TruthSizes>& truth) const;
  /// One number per slice from one per stretch.
  std::vector<double> by_slice(int vehicle, const std::vector<double>& by_stretch) const;
  /// Of |e_z| while |f_hat - f_a| is at most `force_N` (per stretch), `other` included.
  ErrorHistory errors_z(int vehicle, const std::vector<double>& force_N, const ErrorHistory& other) const;

  /// Deviation of a neighbour's relative position and velocity, Euclidean norms.
  double position_deviation_m(const Radii& radii, int vehicle, int neighbour) const;
  double velocity_deviation_m_s(const Radii& radii, int vehicle, int neighbour) const;
  /// The vehicle that is the j-th neighbour of `vehicle`.
  static int neighbour(int vehicle, int j) { return j < vehicle ? j : j + 1; }

 private:
  ErrorHistory start_errors(int vehicle) const;
  void add_lag_parts(bool is_sampled);

  const stability::TrackingSetup& tracking_;
  double network_age_s_;
  const ResidualEnvelope* residual_;
  Interval motor_lag_s_;
  LearnedForce learned_;
  TruthForce truth_;
  Motion motion_;
  ErrorLoops loops_;
  std::vector<LagPart> lag_parts_;
  EstimateErrors estimates_;
  std::array<EstimateAnswer, 3> estimate_answers_;
  std::vector<Interval> excess_N_;  ///< per vehicle
  LagStart lag_start_z_;
};

}  // namespace swarmcert::analysis
