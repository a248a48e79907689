#include "stability/iss/iss_full_loop.h"

#include <algorithm>
#include <cmath>

#include "stability/simulation/continuous_flight.h"

namespace swarmcert::stability {
namespace {

/// Stays where it is.
class Stay : public Task {
 public:
  explicit Stay(double duration_s) : duration_s_(duration_s) {}
  Setpoint at(int, double) const override {
    Setpoint setpoint;
    setpoint.p_W_m.z() = 50;  // far from the ground
    return setpoint;
  }
  double duration_s() const override { return duration_s_; }

 private:
  double duration_s_;
};

}  // namespace

std::vector<FullLoopRun> fly_full_loop(const Gains& gains, const Model& model, const IssCheck& check) {
  constexpr int kAxes = 3, kSamples = 200;
  Model bare = model;  // what effects do is part of the disturbance; only the rotors' lag belongs to the loop
  bare.effects.erase(std::remove_if(bare.effects.begin(), bare.effects.end(),
                                    [](const EffectSpec& effect) { return effect.name != "motor_lag"; }),
                     bare.effects.end());
  std::vector<FullLoopRun> result;
  int ramps = 0, worst_linear = 0;
  for (std::size_t index = 0; index < check.runs.size(); ++index) {
    const IssRun& run = check.runs[index];
    const bool wanted =
        (run.kind == "ramp" && ramps++ < kAxes) || (run.kind == "worst_linear" && worst_linear++ < kAxes);
    if (!wanted) continue;
    Swarm swarm(bare, 1);
    swarm.assume_lag(gains.motor_lag_s, 0);
    const Stay task(check.duration_s);
    ContinuousFlightOptions options;
    options.battery_V = kFullBattery_V;
    ContinuousFlight flight(swarm, gains, task, options, nullptr,
                            [&run](int, double t) { return Eigen::Vector3d(-run.disturbance.at(t)); });
    FullLoopRun flown = {static_cast<int>(index), 0, 0, 0};
    for (int k = 1; k <= kSamples; ++k) {
      flight.advance(check.duration_s * k / kSamples);
      const double* const x = flight.state(0);
      const double error_m = (Eigen::Vector3d(x[0], x[1], x[2]) - task.at(0, 0).p_W_m).norm();
      Eigen::Matrix3d R;
      rotation_of(x + kQuaternion, &R);
      flown.largest_tilt_rad = std::max(flown.largest_tilt_rad, std::acos(std::clamp(R(2, 2), -1.0, 1.0)));
      if (!(error_m / check.ball_m <= flown.ratio)) {
        flown.ratio = std::min(error_m / check.ball_m, 1e6);
        flown.at_s = flight.time_s();
      }
      if (!(error_m < 20)) break;  // lost
    }
    result.push_back(flown);
  }
  return result;
}

}  // namespace swarmcert::stability
