/// @file The declared truth on a set of states: the forces possible there, and how they change with the positions.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "nn/base/interval.h"
#include "stability/model.h"

namespace swarmcert::analysis {

using Offset = std::array<Interval, 3>;  ///< of a neighbour relative to the vehicle, world axes, m

/// Encloses the forces of one vehicle's declared effects in real arithmetic.
class TruthForce {
 public:
  /// @param truth its effects act on every vehicle; its mass is that of every neighbour. Effects that act only
  ///     through the loop or on rotation are no force here.
  /// @param largest_thrust_N maximum total thrust of all rotors.
  TruthForce(const stability::Model& truth, double largest_thrust_N);

  /// Returns why this truth has no enclosure; empty if it has one.
  const std::string& refusal() const { return refusal_; }
  /// Motor lag of the truth; not a force, since the loop has a lag of its own. 0 if the truth declares none.
  double motor_lag_s() const { return motor_lag_s_; }

  /// Force along z of the neighbours' wakes (downwash, upper_lift).
  struct Wake {
    Interval value_N;
    std::vector<Offset> gradient_N_m;  ///< per neighbour, over all points of the set
    /// false: the field may jump inside the set, and only value_N is valid.
    bool has_gradient = true;
    /// The simulator cuts the field off at seven spreads, where it differs from the field of the gradient by at most
    /// this.
    double cut_off_N = 0;
  };
  Wake wake(const std::vector<Offset>& neighbours) const;

  /// Force of all other effects, which depend on the vehicle's own state.
  std::array<Interval, 3> rest_N(Interval height_m, const std::array<Interval, 3>& velocity_m_s) const;

 private:
  struct Downwash {
    double amplitude_N, decay, spread_m, spread_slope, norm;
    Interval mass_factor;
    bool for_some_only;
  };
  struct Lift {
    double amplitude_N, decay, spread_m;
    bool for_some_only;
  };
  void add(const Downwash& field, const std::vector<Offset>& neighbours, Wake& sum) const;
  void add(const Lift& field, const std::vector<Offset>& neighbours, Wake& sum) const;

  stability::Model model_;
  double largest_thrust_N_;
  double motor_lag_s_ = 0;
  std::vector<Downwash> downwash_;
  std::vector<Lift> lift_;
  std::vector<stability::EffectSpec> others_;
  std::string refusal_;
};

}  // namespace swarmcert::analysis
