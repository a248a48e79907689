/// @file The loop that flies: all that gains.toml and model.toml declare about it. Every statement on the tracking
/// error is made about this loop, and takes it from here.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "stability/bounds/loops/coupled_cascade.h"
#include "stability/bounds/loops/sampled_loop.h"
#include "stability/gains.h"
#include "stability/model.h"

namespace swarmcert::stability {

/// The parameters of the vehicle that the loop uses.
struct Plant {
  double mass_kg = 0;
  double thrust_scale = 1;      ///< actual force per commanded force
  double largest_thrust_N = 0;  ///< of all rotors, as commanded; 0: unknown
  double least_thrust_N = 0;    ///< of all rotors, as commanded
  double told_mass_kg = 0;      ///< the mass by which the law commands forces; 0: mass_kg
};

/// One declared property that an ideal loop (continuous, immediate, linear) lacks.
enum class Fact {
  kGainsOfLaw,       ///< the gains themselves
  kSampling,         ///< rate_hz
  kIntegratorStep,   ///< integrator_step_s differs from the period
  kIntegratorClamp,  ///< integrator_limit
  kMotorLag,
  kAttitude,  ///< the thrust's direction follows the attitude: at once, with a lag, or as [attitude] says
  kDelay,
  kNetworkRate,     ///< the learned force is a staircase
  kNetworkLatency,  ///< the learned force is late
  kThrustScale,     ///< the actual force is not the commanded force
  kThrustLimits,    ///< of all rotors together
};

struct FlownLoop {
  Gains gains;
  Plant plant;
  Model model{};                     ///< empty if the loop was made without one
  std::vector<std::string> notes{};  ///< which parts of the model entered the loop

  /// Returns the facts that the fields declare. Statements visit them in a switch without default, so that a new fact
  /// cannot be left out; a new field of Gains or Plant does not compile before it is listed here.
  std::vector<Fact> facts() const;

  bool is_sampled() const { return gains.rate_hz > 0; }
  /// Returns what the integrator adds per second of error: 1 unless its step differs from the period.
  double integral_share() const { return is_sampled() ? gains.integrator_step_s * gains.rate_hz : 1; }
  /// Returns the limit of the integrator's state in firmware, m s.
  double integrator_limit_m_s(int axis) const {
    return gains.integrator_limit_m_s[static_cast<std::size_t>(axis)];
  }
  /// Returns the largest |int e dt| that this limit allows, m s.
  double integral_limit_m_s(int axis) const { return integrator_limit_m_s(axis) / integral_share(); }
  double told_mass_kg() const { return plant.told_mass_kg > 0 ? plant.told_mass_kg : plant.mass_kg; }
  /// Returns the actual acceleration per acceleration that the law commands.
  double command_scale() const { return plant.thrust_scale * told_mass_kg() / plant.mass_kg; }

  /// Returns the law of all axes as accelerations that act, with the Ki that acts.
  PidMatrices law() const;
  /// Returns A of d x/dt = A x, the loop about rest in continuous time, without delay, clamp and limits of the thrust.
  /// x: p~, v, integral, force per mass behind the motor lag, and behind the attitude lag; three of each. States of
  /// absent lags decay and are not read.
  Eigen::Matrix<double, 15, 15> matrix() const;

  /// Returns one axis in continuous time, with the Ki that acts, the lags of the thrust and, for x and y, of its
  /// direction; nothing if Lambda or K couples axes.
  std::optional<AxisLoop> continuous(int axis) const;
  /// Returns the axis as firmware runs it; nothing without rate_hz.
  std::optional<SampledLoop> sampled(int axis) const;

  /// Returns the loop with other gains on one axis, as written in firmware. Requires is_sampled() and uncoupled axes.
  FlownLoop with_axis(int axis, const AxisLoop& written) const;
  /// Returns the axes that Lambda or K couples to others, ascending.
  std::vector<int> coupled_axes() const;
  /// Returns a horizontal axis in continuous time around the attitude loop of [attitude], which takes the place of the
  /// attitude lag, without delay; nothing without such gains or an inertia, for z, and for coupled axes.
  std::optional<Cascade> cascade(int axis) const;
  /// Returns a horizontal axis as firmware runs it around that attitude loop, with the motor lag on the torque and the
  /// delay; nothing also without rate_hz.
  std::optional<SampledLoop> sampled_cascade(int axis) const;
  /// The same as cascade() for coupled axes, z among them without an attitude law. Requires gains.attitude.
  CoupledCascade coupled_cascade(const std::vector<int>& axes) const;

  /// Returns the largest modulus of an eigenvalue of the map from one sample to the next, of all axes together, coupled
  /// or not. Requires is_sampled().
  double spectral_radius() const;
  /// Returns whether the loop that flies is stable: the sampled one with rate_hz, else the continuous one, and that
  /// around the attitude loop if gains.toml states one. Nothing if that is not decided: continuous axes that are
  /// coupled and delayed.
  std::optional<bool> is_stable() const;
  /// Returns whether the loop around the attitude loop of gains.toml is unstable; false without one.
  bool diverges_around_attitude() const;

  /// Returns the actual force of all rotors together, N; the largest is infinite if unknown.
  Interval thrust_range_N() const;
};

/// Returns the smallest force of a rotor at full battery: at the map's minimum, or at p = 0 if the minimum is at p < 0.
double least_rotor_force_N(const ThrustMap& map);

/// Reads both files. The model's effects motor_lag, delay and thrust_ratio enter the loop if gains.toml states no lag
/// or delay of its own.
/// @param battery_V voltage for the largest thrust.
/// @throws files::InputError like load_gains() and read_model().
FlownLoop load_flown_loop(const std::string& gains, const std::string& model,
                          double battery_V = kFullBattery_V);
/// The same for gains and a model that were read before.
FlownLoop flown_loop(Gains gains, Model model, double battery_V = kFullBattery_V);

}  // namespace swarmcert::stability
