#include "analysis/residuals/prediction.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "analysis/residuals/over_tracks.h"
#include "analysis/residuals/statistics.h"
#include "analysis/residuals/thrust_stage.h"
#include "analysis/residuals/torque_residual.h"
#include "stability/effects/registry.h"

namespace swarmcert::residuals {
namespace {

constexpr double kNotPredicted = std::numeric_limits<double>::quiet_NaN();

/// Returns true for effects that change the log and not the motion.
bool is_of_sensors(const std::string& effect) {
  return stability::traits_of(effect).place == stability::Place::kLog;
}

/// Returns q turned by the body rate `omega_B_rad_s` for `step_s`.
Eigen::Quaterniond turned(const Eigen::Quaterniond& q, const Eigen::Vector3d& omega_B_rad_s, double step_s) {
  const Eigen::Vector3d turn = omega_B_rad_s * step_s;
  const double angle = turn.norm();
  const double share = angle > 1e-9 ? std::sin(angle / 2) / angle : 0.5;
  return q * Eigen::Quaterniond(std::cos(angle / 2), share * turn.x(), share * turn.y(), share * turn.z());
}

std::array<double, kNumErrors> distance(const PredictedState& a, const PredictedState& b) {
  const double cosine = std::min(std::abs(a.q_WB.dot(b.q_WB)) / (a.q_WB.norm() * b.q_WB.norm()), 1.0);
  return {(a.p_W_m - b.p_W_m).norm(), (a.v_W_m_s - b.v_W_m_s).norm(), 2 * std::acos(cosine),
          (a.omega_B_rad_s - b.omega_B_rad_s).norm()};
}

void write_state(const PredictedState& state, float* numbers) {
  Eigen::Map<Eigen::Matrix<float, kPredictedNumbers, 1>> row(numbers);
  row << state.p_W_m.cast<float>(), state.v_W_m_s.cast<float>(), state.q_WB.coeffs().cast<float>(),
      state.omega_B_rad_s.cast<float>();
}

/// Returns, for each record, the number of records from it on without contact or gap.
std::vector<std::size_t> clear_records(const Track& track) {
  std::vector<std::size_t> clear(track.instants.size() + 1, 0);
  for (std::size_t i = track.instants.size(); i-- > 0;) {
    const bool on_ground = track.cut[i] == Cut::kContact;
    const bool ends = i + 1 < track.instants.size() && track.restarts[i + 1] != 0;
    clear[i] = on_ground ? 0 : ends ? 1 : clear[i + 1] + 1;
  }
  return clear;
}

double median_step_s(const Track& track) {
  std::vector<double> steps_s;
  for (std::size_t i = 1; i < track.instants.size(); ++i)
    steps_s.push_back(track.instants[i].time_s - track.instants[i - 1].time_s);
  return quantile(steps_s, 0.5);
}

void divide(PredictionErrors& errors, double count) {
  for (HorizonErrors& quantity : errors) {
    for (double& value : quantity.mean) value /= count;
  }
}

}  // namespace

Predictor::Predictor(const stability::Model& model, const Kinds& kinds, const Track& track, Between between)
    : track_(track),
      between_(between),
      mass_kg_(model.mass_kg),
      inertia_kg_m2_(model.inertia_kg_m2[0], model.inertia_kg_m2[1], model.inertia_kg_m2[2]),
      rotor_torque_B_Nm_(rotor_torques(model, kinds, track)) {
  for (const stability::EffectSpec& spec : model.effects) {
    if (is_thrust_stage(spec.name) || is_of_sensors(spec.name) || !spec.acts_on(track.vehicle)) continue;
    auto effect = std::make_unique<stability::AppliedEffect>(
        spec, stability::EffectContext{model.kind, kinds.names, model.path});
    if (!effect->effect().info().remembers) {
      effects_.push_back(std::move(effect));
      continue;
    }
    remembered_.resize(track.instants.size());
    const auto stream = effect->effect().stream(effect->shape().data());
    std::vector<stability::Wrench> columns(effect->coefficients().size());
    for (std::size_t i = 0; i < track.instants.size(); ++i) {
      if (track.restarts[i] != 0) stream->restart();
      stability::Instant now = track.instants[i];
      if (has_torque()) now.torque_B_Nm = rotor_torque_B_Nm_[i];
      stream->advance(now, columns.data());
      for (std::size_t c = 0; c < columns.size(); ++c) {
        remembered_[i].force_W_N += effect->coefficients()[c] * columns[c].force_W_N;
        remembered_[i].torque_B_Nm += effect->coefficients()[c] * columns[c].torque_B_Nm;
      }
    }
  }
}

PredictedState Predictor::measured(std::size_t record) const {
  const stability::Instant& now = track_.instants[record];
  return {now.p_W_m, now.v_W_m_s, Eigen::Quaterniond(now.R_WB), now.omega_B_rad_s};
}

Predictor::Slope Predictor::slope(std::size_t record, const PredictedState& state) const {
  stability::Instant now = track_.instants[record];
  now.p_W_m = state.p_W_m;
  now.v_W_m_s = state.v_W_m_s;
  now.R_WB = state.q_WB.toRotationMatrix();
  now.omega_B_rad_s = state.omega_B_rad_s;
  now.thrust_N = between(record, [&](std::size_t i) { return track_.instants[i].thrust_N; });
  if (has_torque()) now.torque_B_Nm = between(record, [&](std::size_t i) { return rotor_torque_B_Nm_[i]; });
  stability::Wrench sum = {now.thrust_N * now.b3_W(), now.torque_B_Nm};
  if (!remembered_.empty()) {
    sum.force_W_N += between(record, [&](std::size_t i) { return remembered_[i].force_W_N; });
    sum.torque_B_Nm += between(record, [&](std::size_t i) { return remembered_[i].torque_B_Nm; });
  }
  for (const auto& effect : effects_) {
    const stability::Wrench wrench = effect->wrench(now);
    sum.force_W_N += wrench.force_W_N;
    sum.torque_B_Nm += wrench.torque_B_Nm;
  }
  Slope slope;
  slope.acceleration_W_m_s2 = sum.force_W_N / mass_kg_ - stability::kGravity_m_s2 * Eigen::Vector3d::UnitZ();
  slope.angular_B_rad_s2.setZero();
  if (has_torque()) {
    const Eigen::Vector3d momentum = inertia_kg_m2_.cwiseProduct(now.omega_B_rad_s);
    slope.angular_B_rad_s2 =
        (sum.torque_B_Nm - now.omega_B_rad_s.cross(momentum)).cwiseQuotient(inertia_kg_m2_);
  }
  return slope;
}

PredictedState Predictor::step(std::size_t record, const PredictedState& state) const {
  const double step_s = track_.instants[record + 1].time_s - track_.instants[record].time_s;
  const Slope first = slope(record, state);
  const PredictedState middle = {state.p_W_m + step_s / 2 * state.v_W_m_s,
                                 state.v_W_m_s + step_s / 2 * first.acceleration_W_m_s2,
                                 turned(state.q_WB, state.omega_B_rad_s, step_s / 2),
                                 state.omega_B_rad_s + step_s / 2 * first.angular_B_rad_s2};
  const Slope second = slope(record, middle);
  return {state.p_W_m + step_s * middle.v_W_m_s, state.v_W_m_s + step_s * second.acceleration_W_m_s2,
          turned(state.q_WB, middle.omega_B_rad_s, step_s),
          state.omega_B_rad_s + step_s * second.angular_B_rad_s2};
}

double HorizonErrors::sum() const { return std::accumulate(mean.begin(), mean.end(), 0.0); }

double HorizonErrors::at(int step) const {
  return step <= static_cast<int>(mean.size()) ? mean[static_cast<std::size_t>(step - 1)] : kNotPredicted;
}

int prediction_steps(double horizon_s, double step_s) {
  return std::max(1, static_cast<int>(std::lround(std::min(horizon_s / step_s, 1e6))));
}

std::vector<std::size_t> prediction_starts(const Track& track, std::size_t steps) {
  const std::vector<std::size_t> clear = clear_records(track);
  std::vector<std::size_t> starts;
  for (std::size_t i = 0; i < track.instants.size(); ++i) {
    if (clear[i] > steps) starts.push_back(i);
  }
  return starts;
}

FlightPrediction predict(const stability::Model& model, const Kinds& kinds, const Track& track,
                         double horizon_s, bool keeps_states) {
  FlightPrediction flight;
  flight.path = track.path;
  if (!track.has_rates) flight.refused = "the log has no angular rates";
  if (track.instants.size() < 2) flight.refused = "the log is empty";
  if (!flight.refused.empty()) return flight;
  flight.step_s = median_step_s(track);
  const auto steps = static_cast<std::size_t>(prediction_steps(horizon_s, flight.step_s));
  if (track.instants.size() <= steps) {
    flight.refused = "the log is shorter than the horizon";
    return flight;
  }
  const Predictor predictor(model, kinds, track);
  flight.has_torque = predictor.has_torque();
  const std::size_t all = track.instants.size() - steps;
  for (PredictionErrors* errors : {&flight.errors, &flight.held}) {
    for (HorizonErrors& quantity : *errors) quantity.mean.assign(steps, 0);
  }
  if (keeps_states) flight.states.assign(all * steps * kPredictedNumbers, static_cast<float>(kNotPredicted));
  const std::vector<std::size_t> starts = prediction_starts(track, steps);
  flight.starts = starts.size();
  for (const std::size_t start : starts) {
    const PredictedState begin = predictor.measured(start);
    PredictedState state = begin;
    for (std::size_t h = 0; h < steps; ++h) {
      state = predictor.step(start + h, state);
      const PredictedState truth = predictor.measured(start + h + 1);
      const auto error = distance(state, truth), held = distance(begin, truth);
      for (std::size_t quantity = 0; quantity < kNumErrors; ++quantity) {
        flight.errors[quantity].mean[h] += error[quantity];
        flight.held[quantity].mean[h] += held[quantity];
      }
      if (keeps_states) write_state(state, &flight.states[(start * steps + h) * kPredictedNumbers]);
    }
  }
  if (flight.starts == 0) flight.refused = "no stretch of flight is as long as the horizon";
  divide(flight.errors, static_cast<double>(flight.starts));
  divide(flight.held, static_cast<double>(flight.starts));
  return flight;
}

std::vector<FlightPrediction> predict(const Inputs& inputs, double horizon_s, bool keeps_states, int jobs) {
  return over_tracks<FlightPrediction>(
      inputs, jobs, [&](const Track& track, std::vector<FlightPrediction>& flights) {
        flights.push_back(predict(inputs.model_for(track), inputs.kinds, track, horizon_s, keeps_states));
      });
}

PredictionErrors mean_errors(const std::vector<FlightPrediction>& flights,
                             PredictionErrors FlightPrediction::*errors) {
  std::map<std::size_t, int> counts;
  const auto steps_of = [](const FlightPrediction& flight) { return flight.errors[0].mean.size(); };
  for (const FlightPrediction& flight : flights) counts[steps_of(flight)] += flight.refused.empty() ? 1 : 0;
  PredictionErrors mean;
  const auto most = std::max_element(counts.begin(), counts.end(),
                                     [](const auto& a, const auto& b) { return a.second < b.second; });
  if (most == counts.end() || most->second == 0) return mean;
  for (HorizonErrors& quantity : mean) quantity.mean.assign(most->first, 0);
  for (const FlightPrediction& flight : flights) {
    if (!flight.refused.empty() || steps_of(flight) != most->first) continue;
    for (std::size_t quantity = 0; quantity < kNumErrors; ++quantity) {
      for (std::size_t h = 0; h < most->first; ++h)
        mean[quantity].mean[h] += (flight.*errors)[quantity].mean[h];
    }
  }
  divide(mean, most->second);
  return mean;
}

}  // namespace swarmcert::residuals
