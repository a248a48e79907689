/// @file A physical effect: simulation applies the same formula that identification fits to flights.
///
/// An effect is linear in its coefficients c_k and nonlinear in its shape theta:
///   [force_W; torque_B](instant) = sum_k c_k X_k(instant; theta).
/// The simulator sums the columns X_k with the model's coefficients; identification fits the coefficients to the same
/// columns, for every theta of a small grid. Each formula is implemented only once.
///
/// Effects with a memory (motor lag, delays) have no column for a single instant. They produce a stream of columns over
/// a time series, and tell the simulator their place in the signal path (signal_path.h).
///
/// Performance: identification evaluates every effect and theta on all log records, so advance() and columns() must not
/// allocate.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "stability/effects/traits.h"
#include "stability/model.h"

namespace swarmcert::stability {

/// Another vehicle, relative to the one under study.
struct Neighbour {
  Eigen::Vector3d dp_W_m;    ///< its position minus ours
  Eigen::Vector3d dv_W_m_s;  ///< its velocity minus ours
  Eigen::Vector3d v_W_m_s;   ///< its velocity
  double mass_kg;            ///< from its model
  int kind;                  ///< index into EffectContext::kinds
};

/// A vehicle at one instant, in simulation or in a log.
struct Instant {
  double time_s = 0;
  Eigen::Vector3d p_W_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d v_W_m_s = Eigen::Vector3d::Zero();
  Eigen::Matrix3d R_WB = Eigen::Matrix3d::Identity();  ///< body to world
  Eigen::Vector3d omega_B_rad_s = Eigen::Vector3d::Zero();
  /// Total thrust and torque of the rotors as predicted by the model: the thrust map of PWM and battery voltage, after
  /// the model's own delay and motor_lag.
  double thrust_N = 0;
  Eigen::Vector3d torque_B_Nm = Eigen::Vector3d::Zero();
  double rotor_spin_rad_s = 0;  ///< sum of the rotors' speeds, counterclockwise positive; 0: not measured
  double battery_V = kFullBattery_V;
  double mass_kg = 0;  ///< from the vehicle's model
  const Neighbour* neighbours = nullptr;
  int num_neighbours = 0;

  Eigen::Vector3d b3_W() const { return R_WB.col(2); }  ///< thrust axis
};

/// The force and torque per unit of a coefficient, or the total of an effect.
struct Wrench {
  Eigen::Vector3d force_W_N = Eigen::Vector3d::Zero();
  Eigen::Vector3d torque_B_Nm = Eigen::Vector3d::Zero();
};

/// Input and output of Effect::add_force_z() for each of several states of a swarm. Numbers of vehicles are in lines of
/// kRowLength, `stride` numbers apart; `to` may equal `from`.
struct ForceRows {
  const double* const* from;  ///< forces so far
  double* const* to;
  int stride;
};

/// What the bounds of a parameter are multiples of: properties of the vehicle, so that they suit one of 30 g as well as
/// one of 3 kg. A body length is twice the arm.
enum class Unit {
  kOwn,           ///< the unit in the parameter's name
  kWeight,        ///< N
  kMass,          ///< kg
  kArm,           ///< m
  kWeightArm,     ///< N m
  kWeightPerArm,  ///< N/m
  kDrag,          ///< the weight at one body length per second
  kSquaredDrag,   ///< likewise, against the squared velocity
  kPerBattery     ///< 1/V, of the largest voltage
};

/// From the centre to each rotor of a Crazyflie, for which lengths of effects are stated.
inline constexpr double kCrazyflieArm_m = 0.046;

/// A coefficient or a shape parameter.
struct Parameter {
  std::string name;  ///< with its unit, as in model.toml: "drag_N_s_m"
  std::string meaning;
  double value;                   ///< default in simulation
  double lower, upper;            ///< physical bounds on sign and size; infinite if free
  std::vector<double> grid = {};  ///< shape parameters: values that identification tries; empty: only `value`
  Unit unit = Unit::kOwn;         ///< of the bounds; for kArm, values and grid are those for kCrazyflieArm_m
};

/// Static description of an effect, independent of any flight.
struct EffectInfo {
  std::string name;
  std::string equation;
  std::string source;
  /// A name for the effects that flight kinematics cannot distinguish from this one: "mass / payload / thrust scale".
  /// The effect's own name if there are none.
  std::string equivalence_class;
  /// Flight manoeuvres that would reveal the effect; answers "what should I fly?".
  std::string excitation;
  std::vector<Parameter> linear;  ///< coefficients, one column each; at most kMostColumns
  std::vector<Parameter> shape;
  bool remembers = false;         ///< has a memory: use stream(), since no column exists for a single instant
  bool needs_neighbours = false;  ///< cannot be fitted from flights of one vehicle
  EffectTraits traits = {};
};

inline constexpr int kMostColumns = 8;
inline constexpr int kMostShape = 8;

/// The vehicle and the swarm, as far as an effect depends on them.
struct EffectContext {
  std::string kind;                ///< kind of the vehicle itself
  std::vector<std::string> kinds;  ///< Neighbour::kind is an index into this
  std::string path;                ///< model file; network names are relative to its folder
};

/// The range covered by the available flights; an effect may adapt its grid to it.
struct FlightRange {
  double z_min_m = 0;
  double z_max_m = 1;
  double full_battery_V = kFullBattery_V;  ///< of the pack
};

/// The columns of one effect with one theta, along one vehicle's time series.
class ColumnStream {
 public:
  virtual ~ColumnStream() = default;
  /// Forgets the past. Call this at the start and after every gap in the log.
  virtual void restart() {}
  /// @param now instants with ascending times.
  /// @param columns [info().linear.size()]; overwritten with the force and torque per unit of each coefficient.
  virtual void advance(const Instant& now, Wrench* columns) = 0;
  /// Calls advance() for consecutive instants, which is faster where several fit into a SIMD register.
  /// @param width   equal to info().linear.size().
  /// @param columns [count x width], instant by instant.
  virtual void advance_along(const Instant* instants, int count, int width, Wrench* columns);
};

struct Hint;
struct SignalPath;
struct Start;
class SwarmPairs;

/// One effect. Instances may keep scratch memory: use one instance per thread.
class Effect {
 public:
  explicit Effect(EffectInfo info) : info_(std::move(info)) {}
  Effect(EffectInfo info, EffectTraits traits) : info_(std::move(info)) { info_.traits = std::move(traits); }
  virtual ~Effect() = default;
  Effect(const Effect&) = delete;
  Effect& operator=(const Effect&) = delete;

  const EffectInfo& info() const { return info_; }
  int num_columns() const { return static_cast<int>(info_.linear.size()); }

  /// Computes X_k at one instant. Precondition: !info().remembers.
  /// @param shape   theta, [info().shape.size()].
  /// @param columns [num_columns()], overwritten.
  virtual void columns(const Instant& now, const double* shape, Wrench* columns) const = 0;
  /// Computes columns() for several instants, with bitwise identical results. @param columns [count x num_columns()],
  /// instant by instant.
  virtual void columns_along(const Instant* instants, int count, const double* shape, Wrench* columns) const;

  /// Returns true if add_force_z() is implemented. The effect's only column must then be a vertical force that depends
  /// on nothing but pairs of vehicles. This is the fast path for simulated swarms.
  virtual bool takes_pairs() const { return false; }

  virtual bool pairs_need_velocity(const double* shape) const;
  /// Returns the part of a pair's contribution that never changes; it is passed to add_force_z().
  virtual double pair_constant(double neighbour_mass_kg, const double* shape) const;

  /// Adds the coefficient times the column's vertical force to the forces on a swarm's vehicles. Bitwise identical to
  /// the result of columns().
  /// @param states  [num_states], 1 or 2: the swarm in rows (rigid_bodies.h).
  /// @param scratch pairs.scratch_lines() lines of kRowLength.
  virtual void add_force_z(const SwarmPairs& pairs, const double* const* states, int num_states,
                           const double* shape, double coefficient, double* scratch,
                           const ForceRows& forces) const;

  /// Returns the columns along a time series. The effect must outlive the stream.
  virtual std::unique_ptr<ColumnStream> stream(const double* shape) const;

  /// Returns true where the effect, if it exists, acts noticeably. Identification requires enough such samples before
  /// it accepts a coefficient.
  virtual bool in_support(const Instant& now, const double* shape) const;

  /// Returns the thetas that identification tries: by default all combinations of the parameters' grids.
  virtual std::vector<std::vector<double>> grid(const FlightRange& range) const;

  /// Sets where the effect starts if a scan has found `hint`, a formula over one of its variables; by default on its
  /// grid, for vertical forces.
  /// @return false if the formula does not suggest the effect.
  virtual bool start_at(const Hint& hint, Start& start) const;

  /// Enters an effect with a memory, with its coefficients and theta, into the simulated signal path.
  virtual void add_to(SignalPath& path, const double* coefficients, const double* shape) const;

  /// Returns the horizontal distance beyond which a neighbour that is `dz_m` higher has no influence at all; infinite
  /// if there is no such distance, zero if the effect ignores such neighbours. Monotone in dz_m.
  virtual double reach_m(double dz_m, const double* shape) const;

  /// Returns the height differences to a neighbour at which the slope or curvature of the force over height is
  /// discontinuous. The simulation places step boundaries there, since a step across one loses its order of accuracy.
  virtual std::vector<double> bends_m() const { return {}; }

 private:
  EffectInfo info_;
};

/// An effect with its numbers: one [[effect]] of a model, ready for use.
class AppliedEffect {
 public:
  /// @throws files::InputError like make_effect().
  AppliedEffect(const EffectSpec& spec, const EffectContext& context);

  const Effect& effect() const { return *effect_; }
  const std::vector<double>& coefficients() const { return coefficients_; }
  const std::vector<double>& shape() const { return shape_; }

  /// Returns sum_k c_k X_k(now; theta). Precondition: !effect().info().remembers.
  Wrench wrench(const Instant& now) const;

 private:
  std::unique_ptr<Effect> effect_;
  std::vector<double> coefficients_, shape_;
  mutable std::vector<Wrench> columns_;  ///< scratch
};

}  // namespace swarmcert::stability
