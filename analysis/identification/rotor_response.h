/// @file Where the rotors of a vehicle are, from its rates and motor commands: which motor turns it which way.
///
/// Over windows of 0.03 s, the change of a body rate is regressed on the integrals of the forces of the motors,
///   omega_a(t + h) - omega_a(t) = sum_k b_ak int f_k dt + b_a0 h,
/// with f_k in units of the force that carries a rotor's share of the weight, after a first-order lag that is chosen to
/// explain most. The signs of b_ak are those of the rotor's place and sense of rotation. Its magnitude is not used:
/// noise of the commands and filters of the rates reduce it.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "analysis/logs/log.h"
#include "stability/model.h"

namespace swarmcert::identification {

/// Angular acceleration of the body axes per rotor.
struct RotorResponse {
  Eigen::Matrix3Xd gain_rad_s2;     ///< [3 x motors], per share of the weight that a rotor carries in hover
  Eigen::Matrix3Xd standard_error;  ///< of gain_rad_s2
};

/// Returns the response in the records of `log` in which `is_airborne`; nothing if there are fewer than 200 windows or
/// the motors moved together. Precondition: Signals::motor_commands > 0, Signals::rates, Log::hover_command > 0.
std::optional<RotorResponse> rotor_response(const logs::Log& log, const std::vector<char>& is_airborne);

/// Returns the rotors of an X of four with distances `arm_m` from the centre, in the order of the motors; none unless
/// each rotor turns the vehicle one way about x and y by more than five standard errors, and all four stand in
/// different quadrants. Spins are those of the response about z if all exceed five standard errors and those on a
/// diagonal agree, and otherwise those of PX4 and ArduPilot: counterclockwise in front right.
std::vector<stability::RotorPlace> places_of(const RotorResponse& response, double arm_m);

}  // namespace swarmcert::identification
