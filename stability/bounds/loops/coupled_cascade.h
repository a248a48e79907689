/// @file Axes that Lambda or K couples, each around the attitude loop that flies, as one linear loop.
///
/// Axis i is a channel: the loop of attitude_cascade.h with its own attitude law, lags and ratio, whose position loop
/// asks for the acceleration
///   u_i = -sum_j (Kp_ij e_j + Kd_ij e_j' + Ki_ij int e_j).
/// With the state x of all channels and one command per channel, behind its motors, the loop is
///   x' = A x + B c,   c = -C x,
/// with eigenvalues of A - B C. Its margins are those of the loop cut at all commands or at one of them.
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
/// Of all three axes.
PidMatrices pid_matrices(const CompositeGains& gains, double mass_kg);

struct CoupledCascade {
  PidMatrices position;           ///< n x n for n channels, before the ratio of a channel; Ki as it acts
  std::vector<Cascade> channels;  ///< their Kp, Kd, Ki are not read
};

bool is_stable(const CoupledCascade& loop);

/// How far a coupled loop is from oscillating. Damping and frequency are those of the whole loop in each.
struct CoupledMargins {
  /// The gain of every channel changes by one factor; one delay is between the state and all motors. Where nothing is
  /// coupled these are the smallest of the channels' own margins.
  CascadeMargins together;
  /// Per channel: its gain alone changes, its motors alone are delayed. Where nothing is coupled these are
  /// cascade_margins().
  std::vector<CascadeMargins> alone;
};

/// All zero where the loop is not stable. To rounding, not rigorous: see set_gain_margins() for gains; for delays every
/// frequency at which the loop's gain crosses 1 is bracketed on a grid of steps of 2 %, and finer about resonances.
CoupledMargins coupled_margins(const CoupledCascade& loop);

/// By the smallest of all its gain margins, see nearness_to_limit_cycle(const CascadeMargins&).
Nearness nearness_to_limit_cycle(const CoupledMargins& margins);

}  // namespace swarmcert::stability
