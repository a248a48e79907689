/// @file The quadrotor of the ARCH-COMP benchmarks of reachability.
#pragma once

#include <array>

#include "nn/weights/weights.h"
#include "stability/reach/flow.h"

namespace swarmcert::stability {

/// What acts on the quadrotor: the thrust upwards in the body, and torques.
struct QuadrotorInputs {
  TimeSeries thrust_N = 0.0, roll_Nm = 0.0, pitch_Nm = 0.0, yaw_Nm = 0.0;
};

/// Returns x' of the rigid body (Beard, *Quadrotor dynamics and control*, 2008). States x1 .. x12: position north and
/// east, and altitude (m); velocity forward, right and down in the body (m/s); roll, pitch, yaw (rad); body rates
/// (rad/s). g = 9.81 m/s^2, m = 1.4 kg, J = diag(0.054, 0.054, 0.104) kg m^2, enclosed as decimal numbers.
std::vector<TimeSeries> arch_quadrotor(const std::vector<TimeSeries>& x, const QuadrotorInputs& inputs);

/// Returns the box of initial states of the benchmarks, of which x1 .. x6 are symbols 0 .. 5: |x_k| <= radius_k, as
/// decimal numbers, around `altitude` and 0; the rest is 0.
/// @param altitude of the centre, m.
AffineVector arch_start(const std::array<double, 6>& radius, Interval altitude = 0);

/// Benchmark QUAD of the nonlinear category: F = m g - 10 (x3 - 1) + 3 x6, roll torque -x7 - x10, pitch torque
/// -x8 - x11, yaw torque 0.
std::vector<TimeSeries> arch_altitude_step(const std::vector<TimeSeries>& x);

/// Benchmark QUAD with a network of inputs x1 .. x12: F = m g + u1, roll torque u2, pitch torque u3, held over a step.
SampledField arch_network_loop(files::Weights network);

}  // namespace swarmcert::stability
