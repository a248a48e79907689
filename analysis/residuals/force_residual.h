/// @file What a model says about a flight, and what it leaves: r = m a_sf - R (h * R' (T b3 + f_a)), per record, in W.
///
/// Where the specific force is a derivative of the velocity or the position, h is the same weighted mean over the same
/// window as that derivative, in W. T is the thrust map's command behind the model's delay and motor lag; f_a the sum
/// of its effects; h the two-pole low-pass of the accelerometer. It acts in the body, as in the sensor; the firmware
/// then turns the result into W by the attitude of the moment, so that forces are delayed but the thrust axis is not.
/// Filters restart after gaps.
#pragma once

#include <memory>
#include <vector>

#include "analysis/residuals/smoothing_window.h"
#include "analysis/residuals/track.h"
#include "stability/model.h"

namespace swarmcert::residuals {

/// A two-pole Butterworth low-pass, exact for inputs that are linear between the records.
class AccelerometerFilter {
 public:
  /// @param channels signals that pass it together, each of three axes.
  AccelerometerFilter(double cutoff_hz, int channels);
  /// The next record starts in equilibrium.
  void restart() { has_past_ = false; }
  /// Replaces the inputs by the outputs. @param values [3 x channels]
  void advance(double time_s, Eigen::Matrix3Xd& values);

 private:
  /// What a step of this length does.
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
  std::vector<Response> known_;  ///< responses to the steps met last, by a hash
};

/// Turns forces in W into what the log of a track would show of them.
class MeasuredForce {
 public:
  /// @param channels signals that pass together, each of three axes.
  MeasuredForce(const Track& track, const stability::Model& model, int channels);
  /// The next record has no past.
  void restart();
  /// @param forces [3 x channels], in W; zero afterwards along axes that cannot be judged.
  void apply(const stability::Instant& now, Eigen::Matrix3Xd& forces);

 private:
  const bool has_accelerometer_;
  const Eigen::Vector3d judged_;
  AccelerometerFilter filter_;
  SmoothingWindow window_;
};

/// Sets mass, command and thrust of every instant as `model` sees them.
void apply_model(const stability::Model& model, const Kinds& kinds, const CutRules& rules, Track& track);

/// r in newton, one per record, after apply_model(); also of records that are cut.
std::vector<Eigen::Vector3d> force_residual(const stability::Model& model, const Kinds& kinds,
                                            const CutRules& rules, const Track& track);

/// Cuts |f_a,z| >= 50 gf where the rules ask for it. f_a here is the whole force that the nominal model leaves.
void cut_large_forces(const stability::Model& model, const CutRules& rules, Track& track);

}  // namespace swarmcert::residuals
