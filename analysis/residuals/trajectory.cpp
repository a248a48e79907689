#include "analysis/residuals/trajectory.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "nn/base/input_error.h"
#include "stability/simulation/sampled_flight.h"

namespace swarmcert::residuals {
namespace {

/// A stretch of records, [first, last].
struct Piece {
  std::size_t first, last;
};

/// Returns true near the setpoint and nearly level: a simulation must not start while a flight is being recovered.
bool is_calm(const Track& track, std::size_t i) {
  constexpr double kNear_m = 0.1, kNear_m_s = 0.5, kLevel = 0.94;  // cosine of 20 degrees
  const stability::Instant& now = track.instants[i];
  return (now.p_W_m - track.targets[i].p_W_m).norm() < kNear_m &&
         (now.v_W_m_s - track.targets[i].v_W_m_s).norm() < kNear_m_s && now.R_WB(2, 2) > kLevel;
}

std::vector<Piece> pieces_of(const Track& track) {
  std::vector<Piece> pieces;
  const std::size_t n = track.instants.size();
  for (std::size_t i = 0; i < n;) {
    const auto usable = [&](std::size_t k) {
      return track.cut[k] == Cut::kNone && track.targets[k].p_W_m.allFinite() &&
             track.targets[k].v_W_m_s.allFinite();
    };
    if (!usable(i) || !is_calm(track, i)) {
      ++i;
      continue;
    }
    std::size_t end = i + 1;
    while (end < n && usable(end) && track.restarts[end] == 0) ++end;
    if (track.instants[end - 1].time_s - track.instants[i].time_s >= TrajectoryErrors::kShortest_s)
      pieces.push_back({i, end - 1});
    i = end;
  }
  return pieces;
}

/// The log's setpoints, interpolated between its records; the acceleration is a slope over seven records.
class LoggedTask : public stability::Task {
 public:
  LoggedTask(const Track& track, Piece piece) : track_(track), piece_(piece) {}

  stability::Setpoint at(int vehicle, double time_s) const override {
    stability::Setpoint setpoint;
    if (vehicle != 0) return setpoint;  // neighbours are moved manually
    const double now_s = start_s() + time_s;
    while (at_ + 1 < piece_.last && track_.instants[at_ + 1].time_s <= now_s) ++at_;
    while (at_ > piece_.first && track_.instants[at_].time_s > now_s) --at_;
    const double a_s = track_.instants[at_].time_s, b_s = track_.instants[at_ + 1].time_s;
    const double share = std::clamp((now_s - a_s) / (b_s - a_s), 0.0, 1.0);
    const stability::Setpoint &a = track_.targets[at_], &b = track_.targets[at_ + 1];
    setpoint.p_W_m = a.p_W_m + share * (b.p_W_m - a.p_W_m);
    setpoint.v_W_m_s = a.v_W_m_s + share * (b.v_W_m_s - a.v_W_m_s);
    constexpr std::size_t kHalf = 3;
    const std::size_t from = std::max(piece_.first + kHalf, at_) - kHalf;
    const std::size_t to = std::min(piece_.last, at_ + kHalf);
    setpoint.a_W_m_s2 = (track_.targets[to].v_W_m_s - track_.targets[from].v_W_m_s) /
                        (track_.instants[to].time_s - track_.instants[from].time_s);
    return setpoint;
  }
  double duration_s() const override { return track_.instants[piece_.last].time_s - start_s(); }

  double start_s() const { return track_.instants[piece_.first].time_s; }
  /// Returns the record at or before the time of the last at().
  std::size_t record() const { return at_; }

 private:
  const Track& track_;
  const Piece piece_;
  mutable std::size_t at_ = piece_.first;
};

stability::Swarm make_swarm(const stability::Model& model, const Kinds& kinds, const Track& track,
                            std::size_t record) {
  std::vector<stability::Model> models = {model};
  std::vector<int> kind_of = {0};
  const stability::Instant& now = track.instants[record];
  for (int j = 0; j < now.num_neighbours; ++j) {
    const auto kind = static_cast<std::size_t>(now.neighbours[j].kind);
    stability::Model other = model;
    other.kind = kinds.names[kind];
    other.mass_kg = kinds.masses_kg[kind];
    other.effects.clear();
    const auto known = std::find_if(models.begin(), models.end(),
                                    [&](const stability::Model& m) { return m.kind == other.kind; });
    kind_of.push_back(static_cast<int>(known - models.begin()));
    if (known == models.end()) models.push_back(std::move(other));
  }
  return {std::move(models), std::move(kind_of)};
}

void set_state(const stability::Model& model, const Track& track, std::size_t record, double* x) {
  const stability::Instant& now = track.instants[record];
  for (int axis = 0; axis < 3; ++axis) {
    x[stability::kPosition + axis] = now.p_W_m[axis];
    x[stability::kVelocity + axis] = now.v_W_m_s[axis];
    x[stability::kOmega + axis] = now.omega_B_rad_s[axis];
  }
  Eigen::Map<Eigen::Vector4d>(x + stability::kQuaternion) = Eigen::Quaterniond(now.R_WB).coeffs();
  for (std::size_t r = 0; r < stability::kNumRotors; ++r)
    x[stability::kRotors + r] = model.thrust.force_N(track.duty[record][r], now.battery_V);
}

void place_neighbours(const Track& track, std::size_t record, double time_s, stability::SampledFlight& loop) {
  const stability::Instant& now = track.instants[record];
  for (int j = 0; j < now.num_neighbours; ++j) {
    const stability::Neighbour& other = now.neighbours[j];
    double* const x = loop.change_state() + (j + 1) * stability::kVehicleStateSize;
    const Eigen::Vector3d p = now.p_W_m + other.dp_W_m + (time_s - now.time_s) * other.v_W_m_s;
    for (int axis = 0; axis < 3; ++axis) {
      x[stability::kPosition + axis] = p[axis];
      x[stability::kVelocity + axis] = other.v_W_m_s[axis];
    }
    loop.input(j + 1).resting = true;  // keeps it in place during the period
  }
}

/// Maxima and sums of squares per axis and of the vector.
struct Sums {
  Eigen::Vector4d max = Eigen::Vector4d::Zero(), squares = Eigen::Vector4d::Zero();
  double count = 0;

  void add(const Eigen::Vector3d& error) {
    const Eigen::Vector4d size(std::abs(error[0]), std::abs(error[1]), std::abs(error[2]), error.norm());
    max = max.cwiseMax(size);
    squares += size.cwiseAbs2();
    count += 1;
  }
  static Axes axes(const Eigen::Vector4d& v) { return {v[0], v[1], v[2], v[3]}; }
  Axes largest() const { return axes(max); }
  Axes rms() const { return axes((squares / std::max(1.0, count)).cwiseSqrt()); }
};

struct Run {
  Sums from_measured, from_setpoint, measured_from_setpoint;
  bool diverged = false;
};

/// @param residual_N force applied to the vehicle; nullptr: none
void fly_piece(const stability::Model& model, const stability::Gains& gains, const Kinds& kinds,
               const Track& track, Piece piece, const std::vector<Eigen::Vector3d>* residual_N, Run& run) {
  constexpr double kLost_m = 5;
  stability::Swarm swarm = make_swarm(model, kinds, track, piece.first);
  const LoggedTask task(track, piece);
  stability::SampledFlightOptions options;
  options.ground_m = 0;  // the piece ends where the log ends in contact
  const double start_V = track.instants[piece.first].battery_V, end_V = track.instants[piece.last].battery_V;
  options.battery_start_V = start_V;
  options.battery_drop_V_s = std::max(0.0, (start_V - end_V) / task.duration_s());
  stability::SampledFlight loop(swarm, gains, task, options);
  set_state(model, track, piece.first, loop.change_state());
  std::size_t judged = piece.first;
  while (loop.time_s() < task.duration_s()) {
    const double time_s = task.start_s() + loop.time_s();
    task.at(0, loop.time_s());
    const std::size_t record = task.record();
    place_neighbours(track, record, time_s, loop);
    if (residual_N != nullptr) loop.input(0).disturbance_W_N = (*residual_N)[record];
    loop.step();
    // Judge each record once, at the first control period that reaches its time.
    while (judged < piece.last && track.instants[judged + 1].time_s <= task.start_s() + loop.time_s()) {
      ++judged;
      const double since_s = task.start_s() + loop.time_s() - track.instants[judged].time_s;
      const double* const x = loop.state();
      const Eigen::Vector3d v(x[3], x[4], x[5]);
      const Eigen::Vector3d p = Eigen::Vector3d(x[0], x[1], x[2]) - since_s * v;
      const Eigen::Vector3d& measured = track.instants[judged].p_W_m;
      Eigen::Matrix3d R_WB;
      stability::rotation_of(x + stability::kQuaternion, &R_WB);
      if (!((p - measured).norm() < kLost_m) || R_WB(2, 2) < 0) {
        run.diverged = true;
        return;
      }
      if (track.instants[judged].time_s - task.start_s() < TrajectoryErrors::kSettle_s) continue;
      run.from_measured.add(p - measured);
      run.from_setpoint.add(p - track.targets[judged].p_W_m);
      run.measured_from_setpoint.add(measured - track.targets[judged].p_W_m);
    }
  }
}

}  // namespace

stability::Model with_lag(stability::Model model, const stability::Gains& gains) {
  const auto add = [&model](const char* name, const char* parameter, double value_s) {
    const bool has = std::any_of(model.effects.begin(), model.effects.end(),
                                 [name](const stability::EffectSpec& e) { return e.name == name; });
    if (has || value_s <= 0) return;
    stability::EffectSpec spec;
    spec.name = name;
    spec.parameters[parameter] = value_s;
    model.effects.push_back(std::move(spec));
  };
  add("motor_lag", "tau_s", gains.motor_lag_s);
  add("delay", "delay_s", gains.delay_s);
  return model;
}

TrajectoryErrors fly_along(const stability::Model& model, const stability::Gains& gains, const Kinds& kinds,
                           const Track& track, const std::vector<Eigen::Vector3d>& residual_N) {
  TrajectoryErrors errors;
  if (track.targets.empty()) {
    errors.refused = "the log has no set points";
    return errors;
  }
  const std::vector<Piece> pieces = pieces_of(track);
  if (pieces.empty()) {
    errors.refused = "no five seconds of flight without a cut, a gap or a missing set point";
    return errors;
  }
  Run flown, replayed;
  try {
    for (const Piece piece : pieces) {
      fly_piece(model, gains, kinds, track, piece, nullptr, flown);
      fly_piece(model, gains, kinds, track, piece, &residual_N, replayed);
      errors.seconds += track.instants[piece.last].time_s - track.instants[piece.first].time_s -
                        TrajectoryErrors::kSettle_s;
    }
  } catch (const std::invalid_argument& error) {
    throw files::InputError({gains.path, "", "rate_hz", "", error.what(), "choose rates that divide 500 Hz"});
  }
  errors.pieces = static_cast<int>(pieces.size());
  errors.diverged = flown.diverged || replayed.diverged;
  errors.rmse = flown.from_measured.rms();
  errors.max = flown.from_measured.largest();
  errors.measured_rms = flown.measured_from_setpoint.rms();
  errors.measured_max = flown.measured_from_setpoint.largest();
  errors.simulated_rms = flown.from_setpoint.rms();
  errors.simulated_max = flown.from_setpoint.largest();
  errors.replayed_max = replayed.from_setpoint.largest();
  return errors;
}

}  // namespace swarmcert::residuals
