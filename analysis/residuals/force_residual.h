/// @file Force residual of a model in flight: r = m a_sf - R (h * R' (T b3 + f_a)), per record, in W.
///
/// If the specific force is a derivative of the velocity or the position, h is the weighted mean over the same window
/// as that derivative, taken in W. T is the command of the thrust map after the model's delay and motor lag; f_a is the
/// sum of its effects; h is the two-pole low-pass of the accelerometer. It acts in the body frame, as in the sensor;
/// the firmware then rotates the result to W with the current attitude, so forces are delayed but the thrust axis is
/// not. Filters restart after gaps.
#pragma once

#include <memory>
#include <vector>

#include "analysis/residuals/smoothing_window.h"
#include "analysis/residuals/track.h"
#include "stability/model.h"

namespace swarmcert::residuals {

/// A two-pole Butterworth low-pass filter, exact for inputs that are linear between records.
class AccelerometerFilter {
 public:
  /// @param channels number of signals filtered together, each with three axes
  AccelerometerFilter(double cutoff_hz, int channels);
  /// Makes the next record start in equilibrium.
  void restart() { has_past_ = false; }
  /// Replaces the inputs by the outputs. @param values [3 x channels]
  void advance(double time_s, Eigen::Matrix3Xd& values);

 private:
  /// The filter coefficients for one step length.
  struct Response {
    double step_s = -1, inverse_step_1_s = 0;  ///< negative: none yet
    double start_to_output = 0, bend_to_output = 0, start_to_slope = 0, bend_to_slope = 0;
  };
  Response response_to(double step_s) const;
  const Response& known_response(double step_s);
  template <int kCount>
  void advance_block(Eigen::Index first, double* values);

  const double rate_1_s_;
  Response response_;
  bool has_past_ = false;
  double time_s_ = 0;
  Eigen::Matrix3Xd input_, output_, slope_;
  std::vector<Response> known_;  ///< hash table of the responses to recent step lengths
};

/// Converts forces in W to the forces that the log of a track would show.
class MeasuredForce {
 public:
  /// @param channels number of signals processed together, each with three axes
  MeasuredForce(const Track& track, const stability::Model& model, int channels);
  /// Discards the past before the next record.
  void restart();
  /// @param forces [3 x channels], in W; set to zero along axes that cannot be judged
  void apply(const stability::Instant& now, Eigen::Matrix3Xd& forces);

 private:
  const bool has_accelerometer_;
  const Eigen::Vector3d judged_;
  AccelerometerFilter filter_;
  SmoothingWindow window_;
};

/// Sets mass, command and thrust of each instant according to `model`.
void apply_model(const stability::Model& model, const Kinds& kinds, const CutRules& rules, Track& track);

/// Returns r in newton, one per record including cut ones. Precondition: apply_model().
std::vector<Eigen::Vector3d> force_residual(const stability::Model& model, const Kinds& kinds,
                                            const CutRules& rules, const Track& track);

/// Cuts records with |f_a,z| >= 50 gf if the rules require it. Here f_a is the total force beyond the nominal model.
void cut_large_forces(const stability::Model& model, const CutRules& rules, Track& track);

}  // namespace swarmcert::residuals
