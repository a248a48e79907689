/// @file Vehicles that fly a task with a network under a declared truth: the common basis of all tubes.
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

/// Deviation of each vehicle from its setpoint per axis: bounds on |e| and |e'| of vehicle i.
struct Radii {
  std::vector<std::array<double, 3>> position_m, velocity_m_s;

  static Radii none(int vehicles);
  /// Whether every entry is at most that of `other`. False for NaN.
  bool within(const Radii& other) const;
  /// Whether every entry is below that of `other`. False for NaN.
  bool below(const Radii& other) const;
  Radii scaled(double factor, double more) const;  ///< factor x + more
  double largest_position_m(int axis) const;
  double largest_position_m() const;  ///< over all axes
};

Radii smaller(const Radii& a, const Radii& b);  ///< entrywise
Radii larger(const Radii& a, const Radii& b);

/// Deviation of one vehicle from its setpoint: intervals of e and e'.
struct Deviation {
  std::array<Interval, 3> position_m, velocity_m_s;
};
using Deviations = std::vector<Deviation>;  ///< of every vehicle

/// Returns the symmetric intervals of the given radii.
Deviations all_within(const Radii& radii);

/// The declared truth at the states of one stretch: f_a and its sensitivity.
struct TruthSizes {
  Interval force_N[3];
  double rest_width_N = 0;           ///< along z, of all effects but wakes: largest change within the tube
  std::vector<double> gradient_N_m;  ///< per neighbour, |d f_z / d p_j|; infinite where the field jumps
};

/// Enlarges `a` to contain `b`.
void unite(TruthSizes& a, const TruthSizes& b);

/// The loops for motor lags in one part of the lag interval, and the effect of the rotors' initial thrust on z.
struct LagPart {
  ErrorLoops loops;
  LagStart start_z;
};

/// Returns the maximum age of the states behind a prediction while it acts: one period of the network and its
/// latency, plus one period of a sampled loop, which acts on its input for that long.
double network_age_s(const stability::Gains& gains, bool is_sampled = false);

class Scene {
 public:
  /// @param network_age_s maximum age of the states behind a prediction while it acts.
  /// @param is_sampled see error_loops().
  /// @param motor_lag_s see error_loops().
  /// @param estimates errors of each vehicle's own state estimates and of those it receives from others.
  /// @param residual force that acts in addition to the effects of the truth; may be null; must outlive this object.
  /// @throws files::InputError as LearnedForce.
  Scene(const stability::FlownLoop& tracking, const stability::Model& truth, const files::Network& network,
        const stability::Task& task, int vehicles, double network_age_s, double longest_slice_s = kSlice_s,
        bool is_sampled = false, const EstimateErrors& estimates = {},
        const std::optional<Interval>& motor_lag_s = {}, const ResidualEnvelope* residual = nullptr);

  const stability::FlownLoop& tracking() const { return tracking_; }
  const LearnedForce& learned() const { return learned_; }
  const TruthForce& truth() const { return truth_; }
  const ResidualEnvelope* residual() const { return residual_; }  ///< null: none
  const Motion& motion() const { return motion_; }
  const ErrorLoops& loops() const { return loops_; }
  /// Parts that cover the lag interval, none wider than kLagPart unless there would be too many.
  const std::vector<LagPart>& lag_parts() const { return lag_parts_; }
  double network_age_s() const { return network_age_s_; }
  Interval motor_lag_s() const { return motor_lag_s_; }
  bool has_lag_interval() const { return motor_lag_s_.lower < motor_lag_s_.upper; }
  const EstimateErrors& estimates() const { return estimates_; }
  /// Effect of the estimation errors on each axis of every vehicle.
  const EstimateAnswer& estimate_answer(std::size_t axis) const { return estimate_answers_[axis]; }
  int vehicles() const { return motion_.vehicles; }
  /// Returns why no statement is possible; empty otherwise.
  std::string refusal() const;

  /// Returns all states that a vehicle can reach in a stretch while all deviations hold.
  std::vector<Interval> states(const Stretch& stretch, const Deviations& deviations) const;
  /// Returns the same states as the network receives them, with estimation errors.
  std::vector<Interval> seen_states(const Stretch& stretch, const Deviations& deviations) const;
  /// Returns the true offsets of the neighbours, for `states` and for what these become within network_age_s.
  /// @param all all states of the stretch: the velocities at which offsets may change.
  /// @param are_seen `states` are as the network receives them.
  std::vector<Offset> offsets(const std::vector<Interval>& states, const std::vector<Interval>& all,
                              bool are_seen = false) const;
  /// Includes the residual, which may change at any rate.
  TruthForce::Rest rest(const Stretch& stretch, const Deviations& deviations, double acceleration_m_s2) const;
  TruthSizes truth_sizes(const Stretch& stretch, const Deviations& deviations) const;
  std::vector<TruthSizes> truth_sizes(const Radii& radii) const;  ///< of every stretch

  /// Thrust in excess of the weight at t = 0, N: rotors start anywhere between the weight and the force requested by
  /// the first prediction.
  Interval excess_at_start_N(int vehicle) const { return excess_N_[static_cast<std::size_t>(vehicle)]; }

  /// Bounds of the errors of one vehicle from all causes other than f_hat - f_a along z: the lag of the feedforward
  /// and of the truth, the rotors' initial thrust, estimation errors, and along x and y the truth itself.
  std::array<ErrorHistory, 3> other_errors(int vehicle, const std::vector<TruthSizes>& truth) const;
  /// Returns the contribution of one slice to the history of one axis.
  LoopHistory in_slice(const Stretch& stretch, int slice, std::size_t axis, double force_N,
                       const TruthSizes& truth, double position_m, double velocity_m_s) const;
  /// hold_error_N() for an axis of a vehicle.
  double hold_error_N(int vehicle, std::size_t axis, const LoopHistory& history) const;
  /// The same per slice while all deviations are within `radii`.
  /// @param force_N bound on |f_hat - f_a| along z, per stretch.
  std::array<std::vector<double>, 3> hold_sizes_N(int vehicle, const Radii& radii,
                                                  const std::vector<double>& force_N,
                                                  const std::vector<TruthSizes>& truth) const;
  /// Bounds of the errors caused by hold_sizes_N(); zero if the loop is continuous.
  std::array<ErrorHistory, 3> hold_errors(int vehicle, const Radii& radii, const std::vector<double>& force_N,
                                          const std::vector<TruthSizes>& truth) const;
  /// Expands one number per stretch to one number per slice.
  std::vector<double> by_slice(int vehicle, const std::vector<double>& by_stretch) const;
  /// Bounds |e_z| while |f_hat - f_a| is at most `force_N` (per stretch), including `other`.
  ErrorHistory errors_z(int vehicle, const std::vector<double>& force_N, const ErrorHistory& other) const;

  /// Bounds on the deviation of a neighbour's relative position and velocity, in Euclidean norms.
  double position_deviation_m(const Radii& radii, int vehicle, int neighbour) const;
  double velocity_deviation_m_s(const Radii& radii, int vehicle, int neighbour) const;
  /// Returns the vehicle that is the j-th neighbour of `vehicle`.
  static int neighbour(int vehicle, int j) { return j < vehicle ? j : j + 1; }

 private:
  ErrorHistory start_errors(int vehicle) const;
  void add_lag_parts(bool is_sampled);

  const stability::FlownLoop& tracking_;
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
