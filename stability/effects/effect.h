/// @file A physical effect: what it does to a vehicle in simulation is what identification fits to flights.
///
/// An effect is linear in its coefficients c_k and nonlinear in its shape theta:
///   [force_W; torque_B](instant) = sum_k c_k X_k(instant; theta).
/// The simulator sums the columns X_k with the model's coefficients; identification fits the coefficients to the
/// same columns, for every theta of a small grid. There is no second formula anywhere.
///
/// Effects that remember (motor lag, delays) have no column of one instant. They give a stream of columns over a
/// time series, and tell the simulator their place in the path of the signal (signal_path.h).
///
/// Costs: identification goes along all log records with every effect and theta: no heap in advance() or columns().
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "stability/model.h"

namespace swarmcert::stability {

/// Another vehicle, as the one under study meets it.
struct Neighbour {
  Eigen::Vector3d dp_W_m;    ///< its position minus ours
  Eigen::Vector3d dv_W_m_s;  ///< its velocity minus ours
  Eigen::Vector3d v_W_m_s;   ///< its velocity
  double mass_kg;            ///< of its model
  int kind;                  ///< index into EffectContext::kinds
};

/// A vehicle at one instant, in simulation or in a log.
struct Instant {
  double time_s = 0;
  Eigen::Vector3d p_W_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d v_W_m_s = Eigen::Vector3d::Zero();
  Eigen::Matrix3d R_WB = Eigen::Matrix3d::Identity();  ///< body to world
  Eigen::Vector3d omega_B_rad_s = Eigen::Vector3d::Zero();
  /// Total thrust and torque of the rotors as far as the model knows them: thrust map of PWM and battery voltage,
  /// behind the model's own delay and motor_lag.
  double thrust_N = 0;
  Eigen::Vector3d torque_B_Nm = Eigen::Vector3d::Zero();
  double battery_V = kFullBattery_V;
  double mass_kg = 0;  ///< of the vehicle's model
  const Neighbour* neighbours = nullptr;
  int num_neighbours = 0;

  Eigen::Vector3d b3_W() const { return R_WB.col(2); }  ///< thrust axis
};

/// What one unit of a coefficient does; or, summed with coefficients, what an effect does.
struct Wrench {
  Eigen::Vector3d force_W_N = Eigen::Vector3d::Zero();
  Eigen::Vector3d torque_B_Nm = Eigen::Vector3d::Zero();
};

/// Where Effect::add_force_z() puts what it finds for each of several states of a swarm. Numbers of vehicles in lines
/// of kRowLength, `stride` numbers apart; `to` may be `from`.
struct ForceRows {
  const double* const* from;  ///< forces that are already there
  double* const* to;
  int stride;
};

/// A coefficient or a shape parameter.
struct Parameter {
  std::string name;  ///< with its unit, as in model.toml: "drag_N_s_m"
  std::string meaning;
  double value;                   ///< default in simulation
  double lower, upper;            ///< physical bounds: sign and size. Infinite where free.
  std::vector<double> grid = {};  ///< shape parameters: the values identification tries; empty: `value` alone
};

/// What is known of an effect without looking at a flight.
struct EffectInfo {
  std::string name;
  std::string equation;
  std::string source;
  /// Effects that flight kinematics cannot tell apart from this one, as one name: "mass / payload / thrust scale".
  /// The effect's own name where there are none.
  std::string equivalence_class;
  /// Flying that would reveal it, as an answer to "what should I fly?".
  std::string excitation;
  std::vector<Parameter> linear;  ///< coefficients, one column each; at most kMostColumns
  std::vector<Parameter> shape;
  bool remembers = false;         ///< has a memory: use stream(), there is no column of one instant
  bool needs_neighbours = false;  ///< nothing to fit in flights of one vehicle
};

inline constexpr int kMostColumns = 8;
inline constexpr int kMostShape = 8;

/// What an effect must know of its vehicle and of the swarm.
struct EffectContext {
  std::string kind;                ///< of the vehicle itself
  std::vector<std::string> kinds;  ///< Neighbour::kind is an index into this
  std::string path;                ///< of the model file: names of networks are relative to its folder
};

/// What the flights at hand cover; an effect may fit its grid to it.
struct FlightRange {
  double z_min_m = 0;
  double z_max_m = 1;
};

/// The columns of one effect with one theta, along one vehicle's time series.
class ColumnStream {
 public:
  virtual ~ColumnStream() = default;
  /// Forgets the past: call it at the start and after every gap in the log.
  virtual void restart() {}
  /// @param now     times ascend from call to call.
  /// @param columns [info().linear.size()]; force and torque per unit of each coefficient.
  virtual void advance(const Instant& now, Wrench* columns) = 0;
  /// advance() for instants in a row, which is faster where several fit into the processor's registers.
  /// @param width   info().linear.size().
  /// @param columns [count x width], instant by instant.
  virtual void advance_along(const Instant* instants, int count, int width, Wrench* columns);
};

struct SignalPath;
class SwarmPairs;

/// One effect. Instances may keep scratch memory: use one per thread.
class Effect {
 public:
  explicit Effect(EffectInfo info) : info_(std::move(info)) {}
  virtual ~Effect() = default;
  Effect(const Effect&) = delete;
  Effect& operator=(const Effect&) = delete;

  const EffectInfo& info() const { return info_; }
  int num_columns() const { return static_cast<int>(info_.linear.size()); }

  /// X_k of one instant. Precondition: !info().remembers.
  /// @param shape   theta, [info().shape.size()].
  /// @param columns [num_columns()], overwritten.
  virtual void columns(const Instant& now, const double* shape, Wrench* columns) const = 0;
  /// columns() of several instants, the same bits. @param columns [count x num_columns()], instant by instant.
  virtual void columns_along(const Instant* instants, int count, const double* shape, Wrench* columns) const;

  /// Whether add_force_z() gives this effect's one column, which then is a vertical force that depends on nothing but
  /// pairs: the fast way for simulated swarms.
  virtual bool takes_pairs() const { return false; }

  virtual bool pairs_need_velocity(const double* shape) const;
  /// What never changes about a pair: add_force_z() is told it.
  virtual double pair_constant(double neighbour_mass_kg, const double* shape) const;

  /// Adds a coefficient times the column's vertical force to the forces on a swarm's vehicles, the same bits as
  /// columns() gives.
  /// @param states  [num_states], 1 or 2: the swarm in rows (rigid_bodies.h).
  /// @param scratch pairs.scratch_lines() lines of kRowLength.
  virtual void add_force_z(const SwarmPairs& pairs, const double* const* states, int num_states,
                           const double* shape, double coefficient, double* scratch,
                           const ForceRows& forces) const;

  /// The columns along a time series; the effect must outlive the stream.
  virtual std::unique_ptr<ColumnStream> stream(const double* shape) const;

  /// True where the effect, if it exists, acts noticeably: identification counts these samples before it believes a
  /// coefficient.
  virtual bool in_support(const Instant& now, const double* shape) const;

  /// The thetas that identification tries: by default all combinations of the parameters' grids.
  virtual std::vector<std::vector<double>> grid(const FlightRange& range) const;

  /// Effects that remember enter simulation here, with their coefficients and theta.
  virtual void add_to(SignalPath& path, const double* coefficients, const double* shape) const;

  /// Horizontal distance beyond which a neighbour that is `dz_m` higher does nothing at all: infinite where the effect
  /// has no such distance, zero where it looks at no such neighbour. Monotone in dz_m.
  virtual double reach_m(double dz_m, const double* shape) const;

  /// How much higher a neighbour is where the force bends: its slope or curvature over the height jumps there.
  /// Simulation steps onto these heights, since a step across one loses its order.
  virtual std::vector<double> bends_m() const { return {}; }

 private:
  EffectInfo info_;
};

/// An effect with numbers: one [[effect]] of a model, ready to act.
class AppliedEffect {
 public:
  /// @throws files::InputError as make_effect().
  AppliedEffect(const EffectSpec& spec, const EffectContext& context);

  const Effect& effect() const { return *effect_; }
  const std::vector<double>& coefficients() const { return coefficients_; }
  const std::vector<double>& shape() const { return shape_; }

  /// sum_k c_k X_k(now; theta). Precondition: !effect().info().remembers.
  Wrench wrench(const Instant& now) const;

 private:
  std::unique_ptr<Effect> effect_;
  std::vector<double> coefficients_, shape_;
  mutable std::vector<Wrench> columns_;  ///< scratch
};

}  // namespace swarmcert::stability
