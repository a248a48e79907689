#include "stability/effects/pendulum.h"

#include <algorithm>
#include <cmath>

namespace swarmcert::stability {
namespace {

enum PendulumShape { kLength, kDamping };

const Eigen::Vector3d kFall_m_s2(0, 0, -kGravity_m_s2);

/// Position and velocity of the load relative to the vehicle.
struct Swing {
  Eigen::Vector3d r_m, dr_m_s;
};

Swing hanging_still(const double* shape) { return {{0, 0, -shape[kLength]}, Eigen::Vector3d::Zero()}; }

/// Returns the part of the load's relative acceleration that the string must cancel, along its direction, to keep its
/// length; `free_m_s2` is the acceleration without a string. Length errors decay at the rate kKeep_1_s.
double taken_m_s2(const Swing& swing, const double* shape, const Eigen::Vector3d& free_m_s2) {
  constexpr double kKeep_1_s = 20;
  const double off_m2 = 0.5 * (swing.r_m.squaredNorm() - shape[kLength] * shape[kLength]);
  const double off_m2_s = swing.r_m.dot(swing.dr_m_s);
  const double kept = swing.dr_m_s.squaredNorm() + 2 * kKeep_1_s * off_m2_s + kKeep_1_s * kKeep_1_s * off_m2;
  return (swing.r_m.dot(free_m_s2) + kept) / swing.r_m.norm();
}

/// Returns d swing / dt.
Swing swing_rate(const Swing& swing, const double* shape, const Eigen::Vector3d& free_m_s2) {
  return {swing.dr_m_s, free_m_s2 - taken_m_s2(swing, shape, free_m_s2) * swing.r_m.normalized()};
}

Swing moved(const Swing& from, double step_s, const Swing& rate) {
  return {from.r_m + step_s * rate.r_m, from.dr_m_s + step_s * rate.dr_m_s};
}

/// Takes a Runge-Kutta step with constant acceleration of the vehicle.
Swing after(const Swing& from, double step_s, const double* shape, const Eigen::Vector3d& acceleration_m_s2) {
  const auto rate = [&](const Swing& at) {
    return swing_rate(at, shape, kFall_m_s2 - acceleration_m_s2 - shape[kDamping] * at.dr_m_s);
  };
  const Swing k1 = rate(from), k2 = rate(moved(from, step_s / 2, k1)), k3 = rate(moved(from, step_s / 2, k2)),
              k4 = rate(moved(from, step_s, k3));
  const Swing sum = moved(moved(moved(k1, 2, k2), 2, k3), 1, k4);
  return moved(from, step_s / 6, sum);
}

class PendulumStream : public ColumnStream {
 public:
  explicit PendulumStream(const double* shape)
      : shape_{shape[kLength], shape[kDamping]}, swing_(hanging_still(shape)) {}

  void restart() override { has_past_ = false; }

  void advance(const Instant& now, Wrench* columns) override {
    const double h = now.time_s - time_s_;
    if (!has_past_) {
      swing_ = hanging_still(shape_);
      behind_m_s_.setZero();
    } else if (h > 0) {
      follow((now.v_W_m_s - velocity_m_s_) / h, h);
    }
    has_past_ = true;
    time_s_ = now.time_s;
    velocity_m_s_ = now.v_W_m_s;
    const Eigen::Vector3d friction_m_s2 = shape_[kDamping] * swing_.dr_m_s;
    const Eigen::Vector3d free_m_s2 = kFall_m_s2 - behind_m_s_ / kSmoothing_s - friction_m_s2;
    columns[0] = {taken_m_s2(swing_, shape_, free_m_s2) * swing_.r_m.normalized() + friction_m_s2,
                  Eigen::Vector3d::Zero()};
  }

 private:
  static constexpr double kSmoothing_s = 0.04, kLongestStep_s = 0.02;

  /// Advances the swing, with a velocity that is linear between the records.
  void follow(const Eigen::Vector3d& acceleration_m_s2, double h_s) {
    const int steps = std::max(1, static_cast<int>(std::ceil(h_s / kLongestStep_s)));
    for (int k = 0; k < steps; ++k) swing_ = after(swing_, h_s / steps, shape_, acceleration_m_s2);
    const Eigen::Vector3d ramp_m_s = acceleration_m_s2 * kSmoothing_s;
    behind_m_s_ = ramp_m_s + (behind_m_s_ - ramp_m_s) * std::exp(-h_s / kSmoothing_s);
  }

  const double shape_[2];
  bool has_past_ = false;
  double time_s_ = 0;
  Eigen::Vector3d velocity_m_s_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d behind_m_s_ = Eigen::Vector3d::Zero();  ///< lag of the smoothed velocity
  Swing swing_;
};

}  // namespace

EffectInfo Pendulum::describe() {
  return {"pendulum",
          "f = m_l (T n + d r'), r'' = g - a - d r' - T n, |r| = l, n = r / l",
          "Newton's law of a mass point on a taut string",
          "pendulum",
          "sideways steps and turns at the period of the load, 2 pi sqrt(l / g), and slower",
          {{"mass_kg", "m_l: of the load", 0, 0, 5, {}, Unit::kMass}},
          {{"length_m", "l: from the vehicle's centre of mass to the load's", 0.5, 0.02, 20},
           {"damping_1_s", "d: the swing decays as exp(-d t / 2)", 0.2, 0.01, 10}},
          false,
          false,
          {Family::kNone, Family::kThrustScale, ShownBy::kSwing}};
}

void Pendulum::columns(const Instant&, const double*, Wrench* columns) const {
  columns[0] = {kFall_m_s2, Eigen::Vector3d::Zero()};
}

std::unique_ptr<ColumnStream> Pendulum::stream(const double* shape) const {
  return std::make_unique<PendulumStream>(shape);
}

bool Pendulum::in_support(const Instant&, const double*) const { return true; }

std::vector<std::vector<double>> Pendulum::grid(const FlightRange&) const {
  constexpr double kSlowest_rad_s = 2, kFastest_rad_s = 14, kApart_rad_s = 1, kDamping_1_s = 1.2;
  std::vector<std::vector<double>> thetas;
  for (double omega = kFastest_rad_s; omega >= kSlowest_rad_s; omega -= kApart_rad_s)
    thetas.push_back({kGravity_m_s2 / (omega * omega), kDamping_1_s});
  return thetas;
}

Wrench Pendulum::act(const Instant& now, const Eigen::Vector3d& others_W_N, const double* coefficients,
                     const double* shape, const double* states, double* rates) const {
  const double load_kg = coefficients[0];
  Swing swing = hanging_still(shape);
  swing.r_m += Eigen::Vector3d(states[0], states[1], states[2]);
  swing.dr_m_s = {states[3], states[4], states[5]};
  // Vehicle and load pull at each other through friction and string: first the accelerations without a string, then the
  // tension that keeps its length.
  const Eigen::Vector3d friction_N = load_kg * shape[kDamping] * swing.dr_m_s;
  const Eigen::Vector3d free_m_s2 =
      kFall_m_s2 - shape[kDamping] * swing.dr_m_s - (others_W_N + friction_N) / now.mass_kg;
  const double reduced_kg = load_kg * now.mass_kg / (load_kg + now.mass_kg);
  const double tension_N = reduced_kg * taken_m_s2(swing, shape, free_m_s2);
  const Swing rate = swing_rate(swing, shape, free_m_s2);
  for (int i = 0; i < 3; ++i) {
    rates[i] = rate.r_m[i];
    rates[3 + i] = rate.dr_m_s[i];
  }
  return {tension_N * swing.r_m.normalized() + friction_N, Eigen::Vector3d::Zero()};
}

}  // namespace swarmcert::stability
