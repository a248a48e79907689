#include "analysis/reproduction/flying.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "stability/simulation/sampled_flight.h"
#include "stability/tasks/task.h"

namespace swarmcert::reproduction {
namespace {

constexpr double kLost_m = 100;

/// Height of the centre of the box of random walks, m.
constexpr double kMiddle_m = 0.6;

/// A task whose setpoints are moved as the plan says.
class Placed final : public stability::Task {
 public:
  Placed(std::unique_ptr<stability::Task> task, const Plan& plan)
      : task_(std::move(task)), higher_m_(plan.higher_m), drawn_in_(plan.drawn_in) {}
  stability::Setpoint at(int vehicle, double time_s) const override {
    stability::Setpoint setpoint = task_->at(vehicle, time_s);
    const Eigen::Vector3d middle_m(0, 0, kMiddle_m);
    setpoint.p_W_m = middle_m + drawn_in_ * (setpoint.p_W_m - middle_m);
    setpoint.p_W_m.z() += higher_m_;
    setpoint.v_W_m_s *= drawn_in_;
    setpoint.a_W_m_s2 *= drawn_in_;
    return setpoint;
  }
  double duration_s() const override { return task_->duration_s(); }
  std::vector<double> knots_s() const override { return task_->knots_s(); }
  bool starts_on_ground() const override { return task_->starts_on_ground(); }

 private:
  std::unique_ptr<stability::Task> task_;
  double higher_m_, drawn_in_;
};

Eigen::Vector3f three(const double* x) {
  return {static_cast<float>(x[0]), static_cast<float>(x[1]), static_cast<float>(x[2])};
}

}  // namespace

Flown fly(const Setting& setting, const Truth& truth, const Plan& plan, const files::Network* network,
          bool keep_logs) {
  const std::unique_ptr<stability::Task> task = std::make_unique<Placed>(
      stability::make_task(plan.task, {plan.vehicles, plan.duration_s, plan.seed}), plan);
  const stability::Gains gains = stability::load_gains(setting.gains);
  stability::Swarm swarm(truth.model, plan.vehicles);
  swarm.assume_lag(gains.motor_lag_s, gains.delay_s);
  stability::SampledFlightOptions options;
  options.noise = true;
  options.seed = plan.seed;
  options.battery_start_V = truth.battery_V;
  stability::SampledFlight loop(swarm, gains, *task, options, network);
  stability::FlightRecorder recorder(loop, plan.seed);
  Interaction interaction(truth);

  const auto vehicles = static_cast<std::size_t>(plan.vehicles);
  Flown flown;
  flown.vehicles.resize(vehicles);
  std::vector<double> saturated(vehicles);
  const auto periods = std::llround(task->duration_s() / loop.period_s());
  for (long long k = 0; k < periods && !flown.diverged; ++k) {
    loop.step();
    if (keep_logs) recorder.listen();
    for (std::size_t i = 0; i < vehicles; ++i)
      saturated[i] += loop.record(static_cast<int>(i)).saturated ? 1.0 / static_cast<double>(periods) : 0;
    if (!loop.ran_position()) continue;
    for (std::size_t i = 0; i < vehicles; ++i) {
      const double* const x = loop.state() + i * stability::kVehicleStateSize;
      Moment now;
      now.time_s = static_cast<float>(loop.time_s());
      now.p_m = three(x + stability::kPosition);
      now.v_m_s = three(x + stability::kVelocity);
      now.p_d_m = task->at(static_cast<int>(i), loop.time_s()).p_W_m.cast<float>();
      std::vector<Relative> neighbours;
      for (std::size_t j = 0; j < vehicles; ++j) {
        if (j == i) continue;
        const double* const y = loop.state() + j * stability::kVehicleStateSize;
        Relative relative;
        for (int c = 0; c < 6; ++c) relative[static_cast<std::size_t>(c)] = y[c] - x[c];
        neighbours.push_back(relative);
      }
      now.interaction_gf = static_cast<float>(interaction.force_z_gf(neighbours));
      now.prediction_gf =
          static_cast<float>(loop.record(static_cast<int>(i)).prediction_N / stability::kGramForce_N);
      flown.diverged = flown.diverged || !((now.p_m - now.p_d_m).norm() < kLost_m);
      flown.vehicles[i].push_back(now);
    }
  }
  flown.saturated_share = *std::max_element(saturated.begin(), saturated.end());
  for (std::size_t i = 0; keep_logs && i < vehicles; ++i)
    flown.logs.push_back(recorder.records(static_cast<int>(i)));
  return flown;
}

double largest_error_m(const Flown& flown, int axis) {
  if (flown.diverged) return std::numeric_limits<double>::infinity();
  float largest = 0;
  for (const auto& moments : flown.vehicles) {
    for (const Moment& now : moments) largest = std::max(largest, std::abs(now.p_m[axis] - now.p_d_m[axis]));
  }
  return static_cast<double>(largest);
}

std::vector<float> nearest_distances_m(const Flown& flown) {
  std::vector<float> distances;
  for (std::size_t i = 0; i < flown.vehicles.size(); ++i) {
    for (std::size_t k = 0; k < flown.vehicles[i].size(); ++k) {
      float nearest = std::numeric_limits<float>::infinity();
      for (std::size_t j = 0; j < flown.vehicles.size(); ++j) {
        if (j != i) nearest = std::min(nearest, (flown.vehicles[j][k].p_m - flown.vehicles[i][k].p_m).norm());
      }
      distances.push_back(nearest);
    }
  }
  std::sort(distances.begin(), distances.end());
  return distances;
}

Interaction::Interaction(const Truth& truth) : mass_kg_(truth.model.mass_kg) {
  const stability::EffectContext context = {truth.model.kind, {truth.model.kind}, truth.model.path};
  for (const stability::EffectSpec& spec : truth.model.effects) {
    auto effect = std::make_unique<stability::AppliedEffect>(spec, context);
    if (effect->effect().info().needs_neighbours) effects_.push_back(std::move(effect));
  }
}

Interaction::Interaction(const files::Network& network)
    : network_(
          std::make_unique<stability::DeepSetForce>(network, "small", std::vector<std::string>{"small"})) {}

Interaction::Interaction(Interaction&&) noexcept = default;
Interaction::~Interaction() = default;

double Interaction::force_z_gf(const std::vector<Relative>& neighbours) {
  std::vector<stability::Neighbour> all;
  for (const Relative& x : neighbours) {
    const Eigen::Vector3d dv(x[3], x[4], x[5]);
    // The vehicle itself is at rest: no effect of these truths depends on the velocity of the wake.
    all.push_back({{x[0], x[1], x[2]}, dv, dv, mass_kg_, 0});
  }
  stability::Instant now;
  now.mass_kg = mass_kg_;
  now.thrust_N = mass_kg_ * stability::kGravity_m_s2;
  now.p_W_m.z() = 1;
  now.neighbours = all.data();
  now.num_neighbours = static_cast<int>(all.size());
  if (network_) return network_->force_z_N(now) / stability::kGramForce_N;
  double force_N = 0;
  for (const auto& effect : effects_) force_N += effect->wrench(now).force_W_N.z();
  return force_N / stability::kGramForce_N;
}

}  // namespace swarmcert::reproduction
