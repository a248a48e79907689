/// @file Axes coupled by Lambda or K, each with its attitude loop, as one linear loop.
///
/// Axis i is a channel: the loop of attitude_cascade.h with its own attitude law, lags and ratio, whose position loop
/// commands the acceleration
///   u_i = -sum_j (Kp_ij e_j + Kd_ij e_j' + Ki_ij int e_j).
/// With the state x of all channels and one command per channel, before its motors, the loop is
///   x' = A x + B c,   c = -C x,
/// with the eigenvalues of A - B C. Its margins are those of the loop opened at all commands or at one of them.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "stability/bounds/loops/attitude_cascade.h"
#include "stability/gains.h"

namespace swarmcert::stability {

/// The law of CompositeGains as accelerations: u = -(Kp e + Kd e' + Ki int e).
struct PidMatrices {
  Eigen::MatrixXd Kp;  ///< Lambda^2 + 2 K Lambda / m, 1/s^2
  Eigen::MatrixXd Kd;  ///< 2 Lambda + K / m, 1/s
  Eigen::MatrixXd Ki;  ///< K Lambda^2 / m, 1/s^3
};
/// Returns the matrices of all three axes.
PidMatrices pid_matrices(const CompositeGains& gains, double mass_kg);

struct CoupledCascade {
  PidMatrices position;           ///< n x n for n channels, before a channel's ratio; Ki effective
  std::vector<Cascade> channels;  ///< their Kp, Kd, Ki are ignored
};

bool is_stable(const CoupledCascade& loop);

/// Stability margins of a coupled loop. Damping and frequency in each are those of the whole loop.
struct CoupledMargins {
  /// All channels' gains change by a common factor; a common delay precedes all motors. For uncoupled channels these
  /// are the smallest of the channels' own margins.
  CascadeMargins together;
  /// Per channel: only its gain changes, only its motors are delayed. For uncoupled channels these are
  /// cascade_margins().
  std::vector<CascadeMargins> alone;
};

/// Returns the margins; all zero if the loop is unstable. Accurate up to round-off, not rigorous: for gains see
/// set_gain_margins(); for delays, every frequency at which the loop gain crosses 1 is bracketed on a grid with steps
/// of 2 %, finer near resonances.
CoupledMargins coupled_margins(const CoupledCascade& loop);

/// Classifies by the smallest of all gain margins, see nearness_to_limit_cycle(const CascadeMargins&).
Nearness nearness_to_limit_cycle(const CoupledMargins& margins);

}  // namespace swarmcert::stability
