/// @file Small-gain test for a swarm whose learning errors depend on the vehicles' relative motion.
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
  double speed_m_s = 0;       ///< bound on the relative speed of the two references
  double acceleration_m_s2 = 0;
  /// Part of the rate caused by other axes, which this loop does not feed back; added to b.
  double cross_rate_N_s = 0;
  /// +1: the force pushes the vehicles apart, with the slopes above; -1: together; 0: only bounds are known.
  int direction = 0;
};

/// Gains of one vehicle's loop from a learning error of rate 1 N/s (command channel).
struct LoopGains {
  double position = 0;      ///< |h|_1, m
  double velocity = 0;      ///< |h'|_1, m/s
  double acceleration = 0;  ///< |h''|_1, m/s^2
};

/// Motion of a vehicle, in the long run, due to disturbances other than the couplings: sup |e|, |e'| and |e''|.
struct OwnMotion {
  double error_m = 0;
  double speed_m_s = 0;
  double acceleration_m_s2 = 0;
};

struct SmallGain {
  std::vector<std::vector<double>> Gamma;
  double spectral_radius_upper = 0;  ///< proved: max over rows of (Gamma x)_i / x_i for a positive x
  double spectral_radius_lower = 0;  ///< min over rows of the same, if Gamma is irreducible; else 0
  bool proved = false;               ///< spectral_radius_upper < 1
  std::vector<double> rate_N_s;  ///< if proved: D with |eps_i'| <= D_i in the long run, D <= (I - Gamma)^-1 b
  std::vector<double> error_m;   ///< position gain times D_i, plus the vehicle's own error_m
  /// If not proved: the common factor by which all entries of Gamma would have to shrink, and for each coupling the
  /// factor by which it alone would have to; 0 if even removing it does not suffice.
  double missing_factor = 1;
  std::vector<double> missing_factor_of;
};

/// Applies the small-gain test with Gamma_ij = Lp_ij g1 + Lv_ij g2 (i != j), Gamma_ii = sum_j Gamma_ij, b_i = sum_j
/// (Lp_ij V_ij + Lv_ij A_ij + cross): if the spectral radius of Gamma is below 1, D <= (I - Gamma)^-1 b
/// (asymptotically: transients add terms that decay). V_ij and A_ij are those of the references plus, since the loops
/// are linear, those of both vehicles' own motion. Otherwise nothing follows: small gain is sufficient, not necessary.
/// @param loops one per vehicle.
/// @param own one per vehicle, or empty; where it is infinite, so are all bounds.
/// @throws std::invalid_argument if a coupling names a nonexistent vehicle or has a negative number.
SmallGain small_gain(const std::vector<LoopGains>& loops, const std::vector<Coupling>& couplings,
                     const std::vector<OwnMotion>& own = {});

/// @throws std::invalid_argument if a coupling names a nonexistent vehicle or has a negative number.
void check_couplings(const std::vector<Coupling>& couplings, int vehicles);

}  // namespace swarmcert::stability
