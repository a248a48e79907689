#include "stability/iss/iss_full_loop.h"

#include <algorithm>
#include <cmath>

#include "stability/simulation/continuous_flight.h"

namespace swarmcert::stability {
namespace {

/// A task that stays at one point.
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

/// Records the first violated hypothesis and its time; nothing if all hold.
void note_hypotheses(const ContinuousFlight& flight, FullLoopRun* flown) {
  for (const FlightEvent& event : flight.events()) {
    if (!flown->left.empty()) return;
    flown->left_at_s = event.time_s;
    if (event.what == FlightEvent::What::kThrustLimit) flown->left = "the thrust saturates";
    if (event.what == FlightEvent::What::kIntegralClamp) flown->left = "the integral reaches its clamp";
  }
  constexpr double kRightAngle_rad = 1.57079632679489661923;
  if (!flown->left.empty() || flown->largest_tilt_rad < kRightAngle_rad) return;
  flown->left = "the vehicle tilts by 90 degrees";
  flown->left_at_s = flight.time_s();
}

/// Accounts for the error at this time, if the flight has satisfied the hypotheses so far.
void weigh(const ContinuousFlight& flight, const Task& task, double ball_m, FullLoopRun* flown) {
  const double* const x = flight.state(0);
  const double error_m = (Eigen::Vector3d(x[0], x[1], x[2]) - task.at(0, 0).p_W_m).norm();
  Eigen::Matrix3d R;
  rotation_of(x + kQuaternion, &R);
  flown->largest_tilt_rad = std::max(flown->largest_tilt_rad, std::acos(std::clamp(R(2, 2), -1.0, 1.0)));
  note_hypotheses(flight, flown);
  if (!flown->left.empty()) return;
  if (!std::isfinite(error_m)) throw IntegrationError("the state of the vehicle is not finite");
  if (error_m / ball_m <= flown->ratio) return;
  flown->ratio = std::min(error_m / ball_m, 1e6);
  flown->at_s = flight.time_s();
}

void fly(Swarm& swarm, const Gains& gains, const Task& task, const RateDisturbance& disturbance,
         double ball_m, FullLoopRun* flown) {
  constexpr int kSamples = 200;
  ContinuousFlightOptions options;
  options.battery_V = kFullBattery_V;
  try {
    ContinuousFlight flight(swarm, gains, task, options, nullptr,
                            [&](int, double t) { return Eigen::Vector3d(-disturbance.at(t)); });
    try {
      for (int k = 1; k <= kSamples && flown->left.empty(); ++k) {
        flight.advance(task.duration_s() * k / kSamples);
        weigh(flight, task, ball_m, flown);
      }
    } catch (const IntegrationError&) {
      note_hypotheses(flight, flown);
      throw;
    }
  } catch (const IntegrationError& error) {
    if (flown->left.empty()) flown->failure = error.what();
  }
}

}  // namespace

std::vector<FullLoopRun> fly_full_loop(const Gains& gains, const Model& model, const IssCheck& check) {
  constexpr int kAxes = 3;
  Model bare = model;  // effects are part of the disturbance; only the rotors' lag belongs to the loop
  bare.effects.erase(std::remove_if(bare.effects.begin(), bare.effects.end(),
                                    [](const EffectSpec& effect) { return effect.name != "motor_lag"; }),
                     bare.effects.end());
  std::vector<FullLoopRun> result;
  int ramps = 0, worst_linear = 0;
  for (std::size_t index = 0; index < check.runs.size(); ++index) {
    const IssRun& run = check.runs[index];
    const bool wanted =
        (run.kind == "ramp" && ramps++ < kAxes) || (run.kind == "worst_linear" && worst_linear++ < kAxes);
    if (!wanted || !run.is_complete()) continue;
    Swarm swarm(bare, 1);
    swarm.assume_lag(gains.motor_lag_s, 0);
    const Stay task(check.duration_s);
    FullLoopRun flown = {static_cast<int>(index), 0, 0, 0, "", 0, ""};
    fly(swarm, gains, task, run.disturbance, check.ball_m, &flown);
    result.push_back(flown);
  }
  return result;
}

}  // namespace swarmcert::stability
