/// @file A swarm whose learning errors depend on each other's motion: does the loop of bounds close?
#pragma once

#include <string>
#include <vector>

namespace swarmcert::stability {

/// The force on vehicle `on` changes with the motion of vehicle `by` relative to it: per axis under study,
/// |eps_on'| <= Lp |v_rel| + Lv |a_rel|. Downwash acts on the lower vehicle only: list it once.
struct Coupling {
  int on = 0, by = 0;
  double position_N_m = 0;    ///< Lp, along the axis whose loop feels the force
  double velocity_N_s_m = 0;  ///< Lv
  double speed_m_s = 0;       ///< of the reference motion relative to each other, bounded
  double acceleration_m_s2 = 0;
  /// Part of the rate that comes from other axes, which this loop does not feed: added to b.
  double cross_rate_N_s = 0;
  /// +1: the force is known to push the vehicles apart, with the slopes above; -1: together; 0: only bounds are known.
  int direction = 0;
};

/// What one vehicle's loop makes of a learning error of rate 1 N/s (command channel).
struct LoopGains {
  double position = 0;      ///< |h|_1, m
  double velocity = 0;      ///< |h'|_1, m/s
  double acceleration = 0;  ///< |h''|_1, m/s^2
};

/// How far a vehicle moves, in the long run, by what disturbs it beside the couplings: sup |e|, |e'| and |e''|.
struct OwnMotion {
  double error_m = 0;
  double speed_m_s = 0;
  double acceleration_m_s2 = 0;
};

struct SmallGain {
  std::vector<std::vector<double>> Gamma;
  double spectral_radius_upper = 0;  ///< proved: max over rows of (Gamma x)_i / x_i for a positive x
  double spectral_radius_lower = 0;  ///< min over rows of the same, where Gamma is irreducible; else 0
  bool proved = false;               ///< spectral_radius_upper < 1
  std::vector<double>
      rate_N_s;  ///< where proved: D with |eps_i'| <= D_i in the long run, D <= (I - Gamma)^-1 b
  std::vector<double> error_m;  ///< position gain times D_i, and the vehicle's own error_m
  /// Where not proved: by what common factor all entries of Gamma would have to shrink, and for each coupling by what
  /// factor it alone would have to; 0 where even removing it does not suffice.
  double missing_factor = 1;
  std::vector<double> missing_factor_of;
};

/// Gamma_ij = Lp_ij g1 + Lv_ij g2 (i != j), Gamma_ii = sum_j Gamma_ij, b_i = sum_j (Lp_ij V_ij + Lv_ij A_ij + cross):
/// if the spectral radius of Gamma is below 1, D <= (I - Gamma)^-1 b (asymptotically: transients add what decays).
/// V_ij and A_ij are those of the references and, as loops are linear, of both vehicles' own motion.
/// Says nothing where it is not: small gain is sufficient, not necessary.
/// @param loops one per vehicle. @param own one per vehicle, or none; where it is infinite, so are all bounds.
/// @throws std::invalid_argument if a coupling names a vehicle that is not there, or a negative number.
SmallGain small_gain(const std::vector<LoopGains>& loops, const std::vector<Coupling>& couplings,
                     const std::vector<OwnMotion>& own = {});

/// @throws std::invalid_argument if a coupling names a vehicle that is not there, or a negative number.
void check_couplings(const std::vector<Coupling>& couplings, int vehicles);

}  // namespace swarmcert::stability
