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

/// Deviation of one vehicle from its setpoint: intervals of e and e'.
struct Deviation {
  std::array<Interval, 3> position_m, velocity_m_s;
};
using Deviations = std::vector<Deviation>;  ///< of every vehicle

/// Returns the largest |e| of all vehicles along one axis, or along any.
double largest_position_m(const Deviations& deviations, int axis);
double largest_position_m(const Deviations& deviations);

/// The forces along x, y and z.
using Forces_N = std::array<Interval, 3>;

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
  /// Returns the true force with the residual, at all states of the stretch.
  Forces_N true_force_N(const Stretch& stretch, const Deviations& deviations) const;
  /// The same without the neighbours' wakes.
  Forces_N without_wakes_N(const Stretch& stretch, const Deviations& deviations) const;

  /// Thrust in excess of the weight at t = 0, N: rotors start anywhere between the weight and the force requested by
  /// the first prediction.
  Interval excess_at_start_N(int vehicle) const { return excess_N_[static_cast<std::size_t>(vehicle)]; }

  /// Returns the history of an axis in one slice, from bounds on |e| and |e'| there.
  LoopHistory in_slice(int slice, double position_m, double velocity_m_s) const;

  /// Returns the vehicle that is the j-th neighbour of `vehicle`.
  static int neighbour(int vehicle, int j) { return j < vehicle ? j : j + 1; }

 private:
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
};

}  // namespace swarmcert::analysis
