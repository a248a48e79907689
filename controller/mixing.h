/// @file From thrust and torque to rotor forces: actuation matrix, pseudo-inverse, prioritized mixing under saturation.
///
/// Body frame: x forward, y left, z up.
#pragma once

#include <cstdint>

#include "controller/linear_algebra.h"

namespace swarmcert::controller {

inline constexpr int kMostRotors = 8;

/// One rotor, whose thrust is along the body's z axis.
template <typename Scalar>
struct Rotor {
  Scalar x_m, y_m;
  Scalar torque_per_thrust_m;  ///< signed, about z: positive if the reaction torque turns x towards y
};

template <typename Scalar>
struct Rotors {
  int count = 0;
  Rotor<Scalar> at[kMostRotors] = {};
};

/// A wrench eta = (T, tau_x, tau_y, tau_z).
template <typename Scalar>
struct Wrench {
  Scalar thrust_N{};
  Vector3<Scalar> torque_N_m{};
};

/// Rotor forces, in the order of the rotors.
template <typename Scalar>
struct RotorForces {
  Scalar at_N[kMostRotors] = {};
};

/// Returns the four rotors of a Crazyflie in the order of its motors: front right, back right, back left, front left,
/// each arm_m / sqrt(2) from the axes. The reaction torque of the first turns the body clockwise as seen from above.
template <typename Scalar>
inline Rotors<Scalar> crazyflie_rotors(Scalar arm_m, Scalar torque_per_thrust_m) {
  const Scalar d = product(arm_m, Scalar(0.707106781186547524));
  const Scalar c = torque_per_thrust_m;
  Rotors<Scalar> rotors;
  rotors.count = 4;
  rotors.at[0] = {d, -d, -c};
  rotors.at[1] = {-d, -d, c};
  rotors.at[2] = {-d, d, -c};
  rotors.at[3] = {d, d, c};
  return rotors;
}

/// Returns entry (row, rotor) of the actuation matrix B_0 in eta = B_0 f; the rows are T, tau_x, tau_y, tau_z, in N/N
/// and N m/N. (The paper uses squared motor speeds for f; the constant factor is part of the calibration in battery.h.)
template <typename Scalar>
inline Scalar actuation(const Rotor<Scalar>& rotor, int row) {
  switch (row) {
    case 0:
      return Scalar(1);
    case 1:
      return rotor.y_m;
    case 2:
      return -rotor.x_m;
    default:
      return rotor.torque_per_thrust_m;
  }
}

/// Returns eta = B_0 f.
template <typename Scalar>
inline Wrench<Scalar> wrench(const Rotors<Scalar>& rotors, const RotorForces<Scalar>& forces) {
  Scalar eta[4] = {};
  for (int row = 0; row < 4; ++row) {
    for (int i = 0; i < rotors.count; ++i) {
      eta[row] = eta[row] + product(actuation(rotors.at[i], row), forces.at_N[i]);
    }
  }
  return {eta[0], {eta[1], eta[2], eta[3]}};
}

/// Right inverse of the controllable rows of B_0.
template <typename Scalar>
struct Allocation {
  /// 4: the full wrench can be controlled. 3: everything but the yaw torque can be controlled (three rotors, or no
  /// reaction torque), and the last column of `inverse` is 0. 0: unusable, because thrust, roll and pitch cannot all be
  /// controlled (collinear rotors, fewer than three rotors, non-finite numbers), and `inverse` is 0.
  int rank = 0;
  int count = 0;
  Scalar inverse[kMostRotors][4] = {};  ///< rotors by rows of B_0, in N per N or N per N m
};

namespace detail {

/// Computes B' (B B')^-1 for the first `rows` rows of B_0, by a Cholesky factorization of B B' with rows scaled to norm
/// 1. Returns false if a row, after elimination of the rows before it, retains less than 1 % of its norm, or if
/// something overflows.
template <typename Scalar>
inline bool right_inverse(const Rotors<Scalar>& rotors, int rows, Allocation<Scalar>& result) {
  const Scalar zero(0), smallest_pivot = Scalar(1e-4);
  Scalar scale[4], factor[4][4];
  for (int r = 0; r < rows; ++r) {
    Scalar sum = zero;
    for (int i = 0; i < rotors.count; ++i) {
      sum = sum + product(actuation(rotors.at[i], r), actuation(rotors.at[i], r));
    }
    if (!(sum > zero) || !is_finite(sum)) return false;
    scale[r] = Scalar(1) / square_root(sum);
    for (int c = 0; c <= r; ++c) {
      Scalar entry = zero;
      for (int i = 0; i < rotors.count; ++i) {
        entry = entry + product(product(scale[r], actuation(rotors.at[i], r)),
                                product(scale[c], actuation(rotors.at[i], c)));
      }
      for (int k = 0; k < c; ++k) entry = entry - product(factor[r][k], factor[c][k]);
      if (c < r) {
        factor[r][c] = entry / factor[c][c];
      } else {
        if (!(entry > smallest_pivot)) return false;
        factor[r][r] = square_root(entry);
      }
    }
  }
  // Solve (scaled B)(scaled B)' y = unit vector for each column of the inverse.
  for (int column = 0; column < rows; ++column) {
    Scalar y[4];
    for (int r = 0; r < rows; ++r) {
      y[r] = r == column ? Scalar(1) : zero;
      for (int k = 0; k < r; ++k) y[r] = y[r] - product(factor[r][k], y[k]);
      y[r] = y[r] / factor[r][r];
    }
    for (int r = rows - 1; r >= 0; --r) {
      for (int k = r + 1; k < rows; ++k) y[r] = y[r] - product(factor[k][r], y[k]);
      y[r] = y[r] / factor[r][r];
    }
    for (int i = 0; i < rotors.count; ++i) {
      Scalar entry = zero;
      for (int r = 0; r < rows; ++r) {
        entry = entry + product(product(scale[r], actuation(rotors.at[i], r)), y[r]);
      }
      result.inverse[i][column] = product(entry, scale[column]);
      if (!is_finite(result.inverse[i][column])) return false;
    }
  }
  return true;
}

}  // namespace detail

/// Returns the Moore-Penrose inverse of B_0, or of its first three rows if yaw cannot be controlled, as indicated by
/// the rank.
template <typename Scalar>
inline Allocation<Scalar> allocation(const Rotors<Scalar>& rotors) {
  Allocation<Scalar> result;
  if (rotors.count < 3 || rotors.count > kMostRotors) return result;
  result.count = rotors.count;
  for (int rows = 4; rows >= 3; --rows) {
    Allocation<Scalar> attempt;
    attempt.count = rotors.count;
    if (!detail::right_inverse(rotors, rows, attempt)) continue;
    attempt.rank = rows;
    return attempt;
  }
  return result;
}

/// Common limits on the force of every rotor.
template <typename Scalar>
struct ForceLimits {
  Scalar lower_N{};
  Scalar upper_N{};
};

/// Rotor forces, and the share of the desired wrench that they produce.
template <typename Scalar>
struct Mixed {
  RotorForces<Scalar> forces;  ///< each within the limits
  bool valid = false;  ///< false: invalid allocation, limits or wrench; all forces at the lower limit, or 0
  bool thrust_limited = false;
  Scalar thrust_N{};  ///< collective thrust for which the forces were computed
  Scalar roll_pitch_share =
      Scalar(1);                 ///< share of (tau_x, tau_y) kept, 0 to 1; the direction is always kept
  Scalar yaw_share = Scalar(1);  ///< share of tau_z kept
};

namespace detail {

/// Returns the largest share in [0, 1] for which base + share * added is within the limits for every rotor.
/// @param limiting set to the rotor that limits the share, if the share is below 1.
template <typename Scalar>
inline Scalar largest_share(int count, const Scalar* base, const Scalar* added,
                            const ForceLimits<Scalar>& limits, int& limiting) {
  const Scalar zero(0);
  Scalar share(1);
  for (int i = 0; i < count; ++i) {
    const Scalar end = base[i] + added[i];
    Scalar room = zero;
    if (end > limits.upper_N) {
      room = limits.upper_N - base[i];
    } else if (end < limits.lower_N) {
      room = limits.lower_N - base[i];
    } else {
      continue;
    }
    const Scalar own = clamp(room / added[i], zero, Scalar(1));
    if (own < share) {
      share = own;
      limiting = i;
    }
  }
  return share;
}

template <typename Scalar>
struct TorqueShares {
  Scalar roll_pitch, yaw;
};

/// Returns the largest share a of roll and pitch for which base + a tilt + b yaw is within the limits for some share b.
///
/// For each b, the largest a is the minimum over the rotors' limits, a concave function of b. The algorithm ascends
/// this function from b = 0, along the limit of one rotor after another, as long as more yaw relieves the limiting
/// rotor.
/// @param shares   the largest a for b = 0, below 1.
/// @param limiting the rotor that limits it.
template <typename Scalar>
inline TorqueShares<Scalar> relieved_by_yaw(int count, const Scalar* base, const Scalar* tilt,
                                            const Scalar* yaw, const ForceLimits<Scalar>& limits,
                                            TorqueShares<Scalar> shares, int limiting) {
  const Scalar zero(0), one(1);
  for (int step = 0; step < count; ++step) {
    const Scalar slope = -yaw[limiting] / tilt[limiting];  // slope da/db along the limit of this rotor
    if (!(slope > zero)) break;
    Scalar more = one - shares.yaw;
    const Scalar missing = one - shares.roll_pitch;
    const bool completes = product(slope, more) > missing;
    if (completes) more = missing / slope;
    int next = -1;
    bool ends = true;
    for (int i = 0; i < count; ++i) {
      if (i == limiting) continue;
      const Scalar now = base[i] + product(shares.roll_pitch, tilt[i]) + product(shares.yaw, yaw[i]);
      const Scalar change = product(slope, tilt[i]) + yaw[i];
      const Scalar end = now + product(more, change);
      Scalar room = zero;
      if (end > limits.upper_N) {
        room = limits.upper_N - now;
      } else if (end < limits.lower_N) {
        room = limits.lower_N - now;
      } else {
        continue;
      }
      const Scalar own = positive_part(room / change);
      if (!(own < more)) continue;
      more = own;
      next = i;
      // A rotor that is relieved by more roll and pitch limits b, not a.
      ends = end > limits.upper_N ? !(tilt[i] > zero) : !(tilt[i] < zero);
    }
    shares.yaw = shares.yaw + more;
    if (next < 0) {
      shares.roll_pitch = completes ? one : shares.roll_pitch + product(slope, more);
      break;
    }
    shares.roll_pitch = clamp(shares.roll_pitch + product(slope, more), zero, one);
    if (ends) break;
    limiting = next;
  }
  return shares;
}

/// Returns the thrust nearest to `thrust_N` for which all forces, which are proportional to it, are within the limits.
template <typename Scalar>
inline Scalar nearest_thrust_N(const Allocation<Scalar>& allocation, const ForceLimits<Scalar>& limits,
                               Scalar thrust_N) {
  for (int i = 0; i < allocation.count; ++i) {
    const Scalar per_N = allocation.inverse[i][0];
    if (product(per_N, thrust_N) > limits.upper_N && per_N > Scalar(0)) thrust_N = limits.upper_N / per_N;
  }
  for (int i = 0; i < allocation.count; ++i) {
    const Scalar per_N = allocation.inverse[i][0];
    if (product(per_N, thrust_N) < limits.lower_N && per_N > Scalar(0)) thrust_N = limits.lower_N / per_N;
  }
  return thrust_N;
}

}  // namespace detail

/// Mixes thrust and torque with priorities: yaw torque is reduced first, then roll and pitch torque (both by the same
/// factor), and thrust last, only if the rotors together cannot produce that much or that little.
///
/// f = B^+ (T, 0) + a B^+ (0, tau_x, tau_y, 0) + b B^+ (0, 0, 0, tau_z), where T is the nearest feasible thrust, a the
/// largest value in [0, 1] that is feasible with some b in [0, 1], and b the largest value for that a, such that all
/// forces are within the limits. Hence a wrench whose forces are within the limits is produced exactly, even if roll
/// and pitch alone would exceed them, and the forces depend continuously on the wrench. Prioritized mixing with the
/// motor limits at the present battery voltage follows Faessler, Falanga and Scaramuzza, "Thrust mixing, saturation,
/// and body-rate control for accurate aggressive quadrotor flight", RA-L 2017. The order of priorities is specific to
/// this project, because the tracking bounds rely on the thrust. Command less thrust than the maximum of all rotors, or
/// no margin is left for torque.
template <typename Scalar>
inline Mixed<Scalar> mix(const Allocation<Scalar>& allocation, const ForceLimits<Scalar>& limits,
                         const Wrench<Scalar>& wanted) {
  const Scalar zero(0);
  Mixed<Scalar> result;
  result.roll_pitch_share = result.yaw_share = zero;
  const bool limits_hold =
      limits.lower_N <= limits.upper_N && is_finite(limits.lower_N) && is_finite(limits.upper_N);
  if (limits_hold) {
    for (int i = 0; i < kMostRotors; ++i)
      result.forces.at_N[i] = i < allocation.count ? limits.lower_N : zero;
  }
  if (!limits_hold || allocation.rank < 3 || !is_finite(wanted.thrust_N) || !is_finite(wanted.torque_N_m)) {
    return result;
  }

  result.thrust_N = detail::nearest_thrust_N(allocation, limits, wanted.thrust_N);
  result.thrust_limited = result.thrust_N < wanted.thrust_N || result.thrust_N > wanted.thrust_N;

  Scalar force[kMostRotors], added[kMostRotors], yaw[kMostRotors];
  for (int i = 0; i < allocation.count; ++i) force[i] = product(allocation.inverse[i][0], result.thrust_N);

  for (int i = 0; i < allocation.count; ++i) {
    added[i] = product(allocation.inverse[i][1], wanted.torque_N_m.x) +
               product(allocation.inverse[i][2], wanted.torque_N_m.y);
  }
  for (int i = 0; i < allocation.count; ++i) {
    yaw[i] = product(allocation.inverse[i][3], wanted.torque_N_m.z);
    if (!is_finite(force[i]) || !is_finite(added[i]) || !is_finite(yaw[i])) return result;
  }
  result.valid = true;

  int limiting = -1;
  detail::TorqueShares<Scalar> shares = {
      detail::largest_share(allocation.count, force, added, limits, limiting), zero};
  if (shares.roll_pitch < Scalar(1) && allocation.rank == 4) {
    shares = detail::relieved_by_yaw(allocation.count, force, added, yaw, limits, shares, limiting);
  }
  result.roll_pitch_share = shares.roll_pitch;
  const Scalar left = Scalar(1) - shares.yaw;
  for (int i = 0; i < allocation.count; ++i) {
    force[i] = clamp(force[i] + product(shares.roll_pitch, added[i]) + product(shares.yaw, yaw[i]),
                     limits.lower_N, limits.upper_N);
    yaw[i] = product(left, yaw[i]);
  }

  const Scalar more = allocation.rank == 4 || wanted.torque_N_m.z == zero
                          ? detail::largest_share(allocation.count, force, yaw, limits, limiting)
                          : zero;
  result.yaw_share = shares.yaw + product(left, more);
  for (int i = 0; i < allocation.count; ++i) {
    result.forces.at_N[i] = clamp(force[i] + product(more, yaw[i]), limits.lower_N, limits.upper_N);
  }
  return result;
}

}  // namespace swarmcert::controller
