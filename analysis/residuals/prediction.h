/// @file Multi-step prediction: a model integrated from each measured state, with the inputs that the log holds.
///
/// From record i the state follows
///   p' = v,  m v' = T b3 + f_a - m g e3,  q' = q (0, omega) / 2,  J omega' = tau_u + tau_a - omega x J omega
/// with the thrust T and the torque tau_u of the rotors as logged at records i, i + 1, ..., each held until the next
/// record, and the force f_a and torque tau_a of the model's effects at the predicted state. Neighbours stay where the
/// log has them. One midpoint step per record. Effects with a memory enter with their value along the measured motion.
/// The error is the distance between predicted and measured state; that of rotation is the angle between two attitudes.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "analysis/residuals/inputs.h"
#include "analysis/residuals/track.h"
#include "stability/model.h"

namespace swarmcert::residuals {

/// Position and velocity in W, body rates in B, attitude body to world.
struct PredictedState {
  Eigen::Vector3d p_W_m, v_W_m_s;
  Eigen::Quaterniond q_WB;
  Eigen::Vector3d omega_B_rad_s;
};

/// Length of PredictedState as numbers: x y z vx vy vz qx qy qz qw wx wy wz.
inline constexpr int kPredictedNumbers = 13;

/// What acts between two records: the thrust and the torque of the first, as a prediction knows them, or the means of
/// both, which do not come half a step late.
enum class Between { kFirst, kMean };

/// Predicts along one track. The track must outlive it.
class Predictor {
 public:
  /// Precondition: apply_model(), and the track has rates.
  /// @throws files::InputError if an effect of the model cannot be created.
  Predictor(const stability::Model& model, const Kinds& kinds, const Track& track,
            Between between = Between::kFirst);

  /// False if the log does not give the force of each rotor: then omega' = 0.
  bool has_torque() const { return !rotor_torque_B_Nm_.empty(); }

  /// Returns the measured state of a record.
  PredictedState measured(std::size_t record) const;

  /// Returns the state at record + 1 from `state` at `record`. Precondition: record + 1 < records of the track.
  PredictedState step(std::size_t record, const PredictedState& state) const;

 private:
  struct Slope {
    Eigen::Vector3d acceleration_W_m_s2, angular_B_rad_s2;
  };
  Slope slope(std::size_t record, const PredictedState& state) const;

  /// Returns a quantity of each record between `record` and the next one.
  template <class Quantity>
  auto between(std::size_t record, const Quantity& of) const {
    using Value = std::decay_t<decltype(of(record))>;
    return between_ == Between::kFirst ? Value(of(record)) : Value((of(record) + of(record + 1)) / 2);
  }

  const Track& track_;
  Between between_;
  double mass_kg_;
  Eigen::Vector3d inertia_kg_m2_;
  std::vector<Eigen::Vector3d> rotor_torque_B_Nm_;  ///< empty: has_torque() is false
  std::vector<std::unique_ptr<stability::AppliedEffect>> effects_;
  std::vector<stability::Wrench>
      remembered_;  ///< of effects with a memory, one per record; empty if there are none
};

/// Errors of one quantity against the horizon.
struct HorizonErrors {
  std::vector<double> mean;  ///< [steps]: over the starts, of the norm of the error after 1, 2, ... steps

  double sum() const;
  /// Returns the error after `step` steps; NaN beyond the horizon.
  double at(int step) const;
};

/// Position [m], velocity [m/s], rotation [rad], body rates [rad/s].
enum PredictedQuantity : int { kPositionError, kVelocityError, kRotationError, kRateError, kNumErrors };
using PredictionErrors = std::array<HorizonErrors, kNumErrors>;

/// The predictions of one vehicle in one flight.
struct FlightPrediction {
  std::string path;
  std::string refused;            ///< why there is none; otherwise empty
  bool has_torque = true;         ///< Predictor::has_torque()
  double step_s = 0;              ///< median step of the log
  std::size_t starts = 0;         ///< that were predicted
  PredictionErrors errors, held;  ///< `held`: of a prediction that nothing changes
  /// [all starts x steps x 13], row-major, if requested. NaN for starts that are not predicted: those with contact with
  /// the ground or a gap in the log within the horizon.
  std::vector<float> states;
};

/// Returns the number of steps in `horizon_s`, at least 1.
int prediction_steps(double horizon_s, double step_s);

/// Returns the records from which `steps` steps can be predicted: without contact or gap within them.
std::vector<std::size_t> prediction_starts(const Track& track, std::size_t steps);

/// Predicts `horizon_s` from every record of `track` after which so many records follow.
/// @throws files::InputError if an effect of the model cannot be created.
FlightPrediction predict(const stability::Model& model, const Kinds& kinds, const Track& track,
                         double horizon_s, bool keeps_states);

/// Returns predict() for all vehicles with a model, in the order of flights and vehicles. Does not depend on `jobs`.
std::vector<FlightPrediction> predict(const Inputs& inputs, double horizon_s, bool keeps_states, int jobs);

/// Returns the mean over flights of their errors, of those that have the most common number of steps.
/// @param errors &FlightPrediction::errors or &FlightPrediction::held
PredictionErrors mean_errors(const std::vector<FlightPrediction>& flights,
                             PredictionErrors FlightPrediction::*errors);

}  // namespace swarmcert::residuals
