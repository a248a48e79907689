#include "analysis/residuals/force_residual.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "analysis/residuals/published_lag.h"
#include "analysis/residuals/thrust_stage.h"
#include "nn/base/pi.h"
#include "nn/base/rotor_speed.h"
#include "stability/effects/registry.h"

namespace swarmcert::residuals {
namespace {

constexpr double kLargestPublishedForce_gf = 50;

stability::EffectContext context_of(const stability::Model& model, const Kinds& kinds) {
  stability::EffectContext context;
  context.kind = model.kind;
  context.kinds = kinds.names;
  context.path = model.path;
  return context;
}

/// Applies a stage of the signal path to the thrust: u + gain (stage(u) - u).
void pass_stage(const stability::AppliedEffect& stage, Track& track) {
  const auto stream = stage.effect().stream(stage.shape().data());
  for (std::size_t i = 0; i < track.instants.size(); ++i) {
    stability::Instant& now = track.instants[i];
    if (track.restarts[i] != 0) stream->restart();
    stability::Wrench change;
    stream->advance(now, &change);
    now.thrust_N += stage.coefficients()[0] * change.force_W_N.dot(now.b3_W());
  }
}

/// Returns true if the model gives the thrust of its motors at logged commands, and the numbers of motors agree.
bool knows_motors(const stability::Model& model, const Track& track) {
  return model.thrust_curve_N && static_cast<std::size_t>(track.motor_commands) == model.num_rotors();
}

/// Returns the thrust before the model's lags: from duties and the thrust map, or from the thrust in the log.
double commanded_thrust_N(const stability::Model& model, const Track& track, std::size_t record) {
  switch (track.thrust_source) {
    case logs::ThrustSource::kForce:
      return track.given_thrust[record];
    case logs::ThrustSource::kHoverMultiple:
      if (!knows_motors(model, track)) return track.given_thrust[record] * model.weight_N();
      break;
    default:
      break;
  }
  double thrust_N = 0;
  if (track.thrust_source == logs::ThrustSource::kHoverMultiple) {
    for (std::size_t k = 0; k < model.num_rotors(); ++k)
      thrust_N += model.thrust.force_N(track.motor_command[record][k], model.full_battery_V());
    return thrust_N;
  }
  for (const double duty : track.duty[record])
    thrust_N += model.thrust.force_N(duty, track.instants[record].battery_V);
  return thrust_N;
}

/// Returns rotation * (x, y, z) for one or several vectors at once. Sums are in the same order as in Eigen's product.
template <typename Numbers>
void turn(const Eigen::Matrix3d& r, Numbers& x, Numbers& y, Numbers& z) {
  const Numbers turned_x = (r(0, 0) * x + r(0, 1) * y) + r(0, 2) * z;
  const Numbers turned_y = (r(1, 0) * x + r(1, 1) * y) + r(1, 2) * z;
  z = r(2, 0) * x + (r(2, 1) * y + r(2, 2) * z);
  x = turned_x;
  y = turned_y;
}

/// Rotates each column, two at a time. Eigen's own product of the whole matrix needs a copy of all columns.
void turn(const Eigen::Matrix3d& rotation, Eigen::Matrix3Xd& vectors) {
  using Two = double __attribute__((vector_size(2 * sizeof(double))));
  const Eigen::Matrix3d r = rotation;  // a local copy cannot be aliased, so it stays in registers
  double* at = vectors.data();
  double* const end = at + vectors.size();
  for (; end - at >= 6; at += 6) {
    Two x = {at[0], at[3]}, y = {at[1], at[4]}, z = {at[2], at[5]};
    turn(r, x, y, z);
    for (int i = 0; i < 2; ++i) {
      at[3 * i] = x[i];
      at[3 * i + 1] = y[i];
      at[3 * i + 2] = z[i];
    }
  }
  if (at != end) turn(r, at[0], at[1], at[2]);
}

void pass_published_lag(Track& track) {
  double lagged_N = 0;
  for (std::size_t i = 0; i < track.instants.size(); ++i) {
    stability::Instant& now = track.instants[i];
    lagged_N = i == 0 ? now.thrust_N : lagged_N + kPublishedLagPerRecord * (now.thrust_N - lagged_N);
    now.thrust_N = lagged_N;
  }
}

}  // namespace

AccelerometerFilter::AccelerometerFilter(double cutoff_hz, int channels)
    : rate_1_s_(2 * kPi * cutoff_hz / std::sqrt(2.0)),
      input_(3, channels),
      output_(3, channels),
      slope_(3, channels),
      known_(256) {}

// y'' = w^2 (u - y) - sqrt(2) w y' with a = w / sqrt(2). For u = u0 + s t the particular solution is u0 + s t - s / a;
// the rest decays as e^{-a t} (e0 cos a t + (e0' + a e0) / a sin a t).
AccelerometerFilter::Response AccelerometerFilter::response_to(double step_s) const {
  const double a = rate_1_s_, decay = std::exp(-a * step_s);
  const double c = decay * std::cos(a * step_s), s = decay * std::sin(a * step_s);
  return {step_s, 1 / step_s, c + s, s * (1 / a), 2 * a * s, c - s};
}

// Clocks count in milliseconds or microseconds, so a log has few different steps, which recur in every fit.
const AccelerometerFilter::Response& AccelerometerFilter::known_response(double step_s) {
  std::uint64_t bits = 0;
  std::memcpy(&bits, &step_s, sizeof bits);
  Response& known = known_[(bits * 0x9E3779B97F4A7C15u) >> 56];
  if (known.step_s != step_s) known = response_to(step_s);
  return known;
}

/// Processes kCount numbers at once, which the compiler keeps in registers.
template <int kCount>
void AccelerometerFilter::advance_block(Eigen::Index first, double* values) {
  using Numbers = Eigen::Array<double, kCount, 1>;
  Eigen::Map<Numbers> value(values + first), last(input_.data() + first);
  Eigen::Map<Numbers> y(output_.data() + first), slope(slope_.data() + first);
  const Numbers u = value, ramp = (u - last) * response_.inverse_step_1_s, delayed = ramp * (1 / rate_1_s_);
  const Numbers start = y - last + delayed, bend = slope - ramp;
  y = u - delayed + response_.start_to_output * start + response_.bend_to_output * bend;
  slope = ramp + response_.bend_to_slope * bend - response_.start_to_slope * start;
  last = u;
  value = y;
}

void AccelerometerFilter::advance(double time_s, Eigen::Matrix3Xd& values) {
  if (!has_past_) {
    input_ = output_ = values;
    slope_.setZero();
  } else {
    const double step_s = time_s - time_s_;
    if (step_s != response_.step_s) response_ = known_response(step_s);
    // A single pass over the signals without temporary matrices and divisions, because every record of every fit passes
    // through here.
    constexpr int kBlock = 4;
    Eigen::Index next = 0;
    for (; next + kBlock <= values.size(); next += kBlock) advance_block<kBlock>(next, values.data());
    for (; next < values.size(); ++next) advance_block<1>(next, values.data());
  }
  has_past_ = true;
  time_s_ = time_s;
}

MeasuredForce::MeasuredForce(const Track& track, const stability::Model& model, int channels)
    : has_accelerometer_(track.force_source == logs::ForceSource::kAccelerometer),
      judged_(track.judged),
      filter_(model.sensor.accelerometer_cutoff_hz, channels),
      window_(track.force_source, track.window_s, channels) {}

void MeasuredForce::restart() {
  filter_.restart();
  window_.restart();
}

void MeasuredForce::apply(const stability::Instant& now, Eigen::Matrix3Xd& forces) {
  if (has_accelerometer_) {
    turn(now.R_WB.transpose(), forces);
    filter_.advance(now.time_s, forces);
    turn(now.R_WB, forces);
  } else {
    window_.average(now.time_s, forces);
  }
  for (int axis = 0; axis < 3; ++axis) {
    if (judged_[axis] == 0) forces.row(axis).setZero();
  }
}

namespace {

/// Returns the sum of the measured rotor speeds, counterclockwise positive; 0 if the log has none.
double rotor_spin_rad_s(const std::vector<stability::RotorPlace>& rotors, const Track& track,
                        std::size_t record) {
  double sum = 0;
  if (!track.has_rotor_speeds || static_cast<std::size_t>(track.motor_commands) != rotors.size()) return sum;
  for (std::size_t k = 0; k < rotors.size(); ++k)
    sum += (rotors[k].counterclockwise ? 1 : -1) * kFullRotorSpeed_rad_s * track.motor_command[record][k];
  return sum;
}

}  // namespace

void apply_model(const stability::Model& model, const Kinds& kinds, const CutRules& rules, Track& track) {
  const std::vector<stability::RotorPlace> rotors = rotor_places(model);
  for (std::size_t i = 0; i < track.instants.size(); ++i) {
    stability::Instant& now = track.instants[i];
    now.mass_kg = model.mass_kg;
    now.rotor_spin_rad_s = rotor_spin_rad_s(rotors, track, i);
    now.thrust_N = commanded_thrust_N(model, track, i);
  }
  if (rules.has_published_signals()) {
    pass_published_lag(track);
    return;
  }
  // Delays before lags: the registry has them the other way round.
  std::vector<std::string> stages = stability::effect_names();
  stages.erase(std::remove_if(stages.begin(), stages.end(),
                              [](const std::string& name) { return !is_thrust_stage(name); }),
               stages.end());
  for (auto stage = stages.rbegin(); stage != stages.rend(); ++stage) {
    for (const stability::EffectSpec& spec : model.effects) {
      if (spec.name == *stage) pass_stage(stability::AppliedEffect(spec, context_of(model, kinds)), track);
    }
  }
}

std::vector<Eigen::Vector3d> force_residual(const stability::Model& model, const Kinds& kinds,
                                            const CutRules& rules, const Track& track) {
  std::vector<std::unique_ptr<stability::AppliedEffect>> effects;
  std::vector<std::unique_ptr<stability::ColumnStream>> streams;
  for (const stability::EffectSpec& spec : model.effects) {
    if (is_thrust_stage(spec.name) || !spec.acts_on(track.vehicle)) continue;
    effects.push_back(std::make_unique<stability::AppliedEffect>(spec, context_of(model, kinds)));
    streams.push_back(effects.back()->effect().stream(effects.back()->shape().data()));
  }
  MeasuredForce measured(track, model, 1);
  std::vector<Eigen::Vector3d> residual(track.instants.size());
  stability::Wrench columns[stability::kMostColumns];
  for (std::size_t i = 0; i < track.instants.size(); ++i) {
    const stability::Instant& now = track.instants[i];
    if (track.restarts[i] != 0) {
      measured.restart();
      for (const auto& stream : streams) stream->restart();
    }
    Eigen::Matrix3Xd force = now.thrust_N * now.b3_W();
    for (std::size_t k = 0; k < effects.size(); ++k) {
      streams[k]->advance(now, columns);
      for (int c = 0; c < effects[k]->effect().num_columns(); ++c)
        force.col(0) += effects[k]->coefficients()[static_cast<std::size_t>(c)] * columns[c].force_W_N;
    }
    if (!rules.has_published_signals()) measured.apply(now, force);
    residual[i] = (model.mass_kg * track.specific_force_m_s2[i] - force.col(0)).cwiseProduct(track.judged);
  }
  return residual;
}

void cut_large_forces(const stability::Model& model, const CutRules& rules, Track& track) {
  if (!rules.published) return;
  for (std::size_t i = 0; i < track.instants.size(); ++i) {
    const stability::Instant& now = track.instants[i];
    const double f_az_N = model.mass_kg * track.specific_force_m_s2[i].z() - now.thrust_N * now.b3_W().z();
    if (track.cut[i] == Cut::kNone && std::abs(f_az_N) >= kLargestPublishedForce_gf * stability::kGramForce_N)
      track.cut[i] = Cut::kLargeForce;
  }
  track.used = static_cast<std::size_t>(std::count(track.cut.begin(), track.cut.end(), Cut::kNone));
}

}  // namespace swarmcert::residuals
