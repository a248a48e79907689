#include "stability/bounds/flown_loop.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "stability/bounds/loops/sampled_adjoint.h"
#include "stability/bounds/loops/sampled_model.h"
#include "stability/gains_matrices.h"

namespace swarmcert::stability {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// The flight code runs its attitude law at 500 Hz. A torque that is held for a period acts half of it late on average.
constexpr double kAttitudePeriod_s = 0.002;

/// One axis with the given gains; lags and delay as declared.
AxisLoop with_gains(const FlownLoop& loop, int axis, double Kp, double Kd, double Ki) {
  AxisLoop result = {loop.plant.mass_kg, Kp, Kd, Ki, {}, loop.gains.delay_s};
  if (loop.gains.motor_lag_s > 0) result.lags_s.push_back(loop.gains.motor_lag_s);
  if (axis < 2 && loop.gains.attitude_lag_s > 0) result.lags_s.push_back(loop.gains.attitude_lag_s);
  return result;
}

/// The law of all axes as accelerations that act, with Ki as written.
PidMatrices written_law(const FlownLoop& loop) {
  const Gains& gains = loop.gains;
  PidMatrices result;
  if (gains.composite) {
    result = pid_matrices(*gains.composite, loop.told_mass_kg());
  } else {
    const auto diagonal = [](const auto& v) { return to_eigen(v).asDiagonal().toDenseMatrix(); };
    result = {diagonal(gains.pid->Kp_1_s2), diagonal(gains.pid->Kd_1_s), diagonal(gains.pid->Ki_1_s3)};
  }
  for (MatrixXd* const gain : {&result.Kp, &result.Kd, &result.Ki}) *gain *= loop.command_scale();
  return result;
}

/// One axis of the law; nothing if the axis is coupled to another.
std::optional<AxisLoop> alone(const FlownLoop& loop, const PidMatrices& law, int axis) {
  for (const MatrixXd* const gain : {&law.Kp, &law.Kd, &law.Ki}) {
    for (int other = 0; other < 3; ++other) {
      if (other != axis && ((*gain)(axis, other) != 0 || (*gain)(other, axis) != 0)) return std::nullopt;
    }
  }
  return with_gains(loop, axis, law.Kp(axis, axis), law.Kd(axis, axis), law.Ki(axis, axis));
}

/// The lags, the thrust ratio and, for x and y, the attitude law of an axis, without its position gains.
Cascade without_position(const FlownLoop& loop, int axis) {
  Cascade result;
  result.ratio = loop.plant.thrust_scale;
  result.lag_s = loop.gains.motor_lag_s;
  if (axis == 2) return result;
  const auto about = static_cast<std::size_t>(1 - axis);  // the vehicle tilts about its other horizontal axis
  const AttitudeGains& law = *loop.gains.attitude;
  const double inertia = loop.model.inertia_kg_m2[about];
  result.attitude = AttitudeLoop{law.KR_Nm[about] / inertia, law.Kw_Nm_s[about] / inertia,
                                 law.KI_Nm_per_s[about] / inertia};
  result.body_rate_lag_s = loop.gains.body_rate_lag_s;
  return result;
}

SampledLoop at_rate(const FlownLoop& loop, const AxisLoop& axis) {
  return {axis, 1 / loop.gains.rate_hz, loop.gains.integrator_step_s};
}

}  // namespace

std::vector<Fact> FlownLoop::facts() const {
  const auto& [path, sha256, pid, composite, integrator_limit, rate_hz, integrator_step_s, attitude_law,
               attitude, motor_lag_s, attitude_lag_s, body_rate_lag_s, delay_s, network_rate_hz,
               network_latency_s] = gains;
  const auto& [mass_kg, thrust_scale, largest_N, least_N, told_kg] = plant;
  std::vector<Fact> result = {Fact::kGainsOfLaw};
  const auto add = [&result](bool is_declared, Fact fact) {
    if (is_declared) result.push_back(fact);
  };
  add(rate_hz > 0, Fact::kSampling);
  add(std::abs(integral_share() - 1) >= 1e-9, Fact::kIntegratorStep);
  add(motor_lag_s > 0, Fact::kMotorLag);
  add(true, Fact::kAttitude);  // its law, gains, lag and the lag of the measured body rates
  add(delay_s > 0, Fact::kDelay);
  add(std::any_of(integrator_limit.begin(), integrator_limit.end(),
                  [](double m_s) { return std::isfinite(m_s); }),
      Fact::kIntegratorClamp);
  add(network_rate_hz > 0, Fact::kNetworkRate);
  add(network_latency_s > 0, Fact::kNetworkLatency);
  add(command_scale() != 1, Fact::kThrustScale);
  add(largest_N > 0 || least_N > 0, Fact::kThrustLimits);
  return result;
}

PidMatrices FlownLoop::law() const {
  PidMatrices result = written_law(*this);
  result.Ki *= integral_share();
  return result;
}

Eigen::Matrix<double, 15, 15> FlownLoop::matrix() const {
  constexpr Index kP = 0, kV = 3, kI = 6, kMotor = 9, kAttitude = 12;
  constexpr double kUnread_1_s = 1e3;
  using Rows = Eigen::Matrix<double, 3, 15>;
  const PidMatrices feedback = law();
  const Eigen::Matrix3d one = Eigen::Matrix3d::Identity();
  Eigen::Matrix<double, 15, 15> a = Eigen::Matrix<double, 15, 15>::Zero();
  a.block<3, 3>(kP, kV) = a.block<3, 3>(kI, kP) = one;
  a.block<3, 3>(kMotor, kMotor) = a.block<3, 3>(kAttitude, kAttitude) = -kUnread_1_s * one;
  Rows force = Rows::Zero();
  force << -feedback.Kp, -feedback.Kd, -feedback.Ki, Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero();
  if (gains.motor_lag_s > 0) {
    a.middleRows<3>(kMotor) = force / gains.motor_lag_s;
    a.block<3, 3>(kMotor, kMotor) -= one / gains.motor_lag_s;
    force.setZero();
    force.block<3, 3>(0, kMotor) = one;
  }
  if (gains.attitude_lag_s > 0) {
    a.middleRows<2>(kAttitude) = force.topRows<2>() / gains.attitude_lag_s;
    a.block<2, 2>(kAttitude, kAttitude) -= one.topLeftCorner<2, 2>() / gains.attitude_lag_s;
    force.topRows<2>().setZero();
    force.block<2, 2>(0, kAttitude) = one.topLeftCorner<2, 2>();
  }
  a.middleRows<3>(kV) = force;
  return a;
}

std::optional<AxisLoop> FlownLoop::continuous(int axis) const { return alone(*this, law(), axis); }

std::optional<SampledLoop> FlownLoop::sampled(int axis) const {
  const std::optional<AxisLoop> written = alone(*this, written_law(*this), axis);
  if (!written || !is_sampled()) return std::nullopt;
  return at_rate(*this, *written);
}

FlownLoop FlownLoop::with_axis(int axis, const AxisLoop& written) const {
  PerAxis Kp{}, Kd{}, Ki{};
  for (int i = 0; i < 3; ++i) {
    const AxisLoop one = i == axis ? written : sampled(i)->plant;
    const auto k = static_cast<std::size_t>(i);
    Kp[k] = one.Kp / command_scale();
    Kd[k] = one.Kd / command_scale();
    Ki[k] = one.Ki / command_scale();
  }
  FlownLoop result = *this;
  result.gains.composite.reset();
  result.gains.pid = PidGains{{Kp[0], Kp[1], Kp[2]}, {Kd[0], Kd[1], Kd[2]}, {Ki[0], Ki[1], Ki[2]}};
  return result;
}

std::vector<int> FlownLoop::coupled_axes() const {
  std::vector<int> result;
  for (int axis = 0; axis < 3; ++axis)
    if (!continuous(axis)) result.push_back(axis);
  return result;
}

std::optional<Cascade> FlownLoop::cascade(int axis) const {
  const std::optional<AxisLoop> position = continuous(axis);
  if (axis == 2 || !position || !gains.attitude || !(model.inertia_kg_m2[0] > 0)) return std::nullopt;
  Cascade result = without_position(*this, axis);
  // The gains of the loop already contain the thrust scale.
  result.Kp = position->Kp / result.ratio;
  result.Kd = position->Kd / result.ratio;
  result.Ki = position->Ki / result.ratio;
  return result;
}

std::optional<SampledLoop> FlownLoop::sampled_cascade(int axis) const {
  const std::optional<Cascade> around = cascade(axis);
  std::optional<SampledLoop> result = sampled(axis);
  if (!around || !result) return std::nullopt;
  const AttitudeLoop& law = *around->attitude;
  const double ratio = around->ratio;
  result->attitude = AttitudeLoop{ratio * law.KR_J_s2, ratio * law.Kw_J_s, ratio * law.KI_J_s3};
  result->body_rate_lag_s = around->body_rate_lag_s;
  result->plant.lags_s = {around->lag_s, kAttitudePeriod_s / 2};
  return result;
}

CoupledCascade FlownLoop::coupled_cascade(const std::vector<int>& axes) const {
  CoupledCascade result;
  const PidMatrices all = pid_matrices(*gains.composite, plant.mass_kg);
  result.position = {all.Kp(axes, axes), all.Kd(axes, axes), all.Ki(axes, axes)};
  result.position.Ki *= integral_share();
  for (const int axis : axes) result.channels.push_back(without_position(*this, axis));
  return result;
}

double FlownLoop::spectral_radius() const {
  double largest = 0;
  bool is_coupled = false;
  for (int axis = 0; axis < 3; ++axis) {
    const std::optional<SampledLoop> one = sampled(axis);
    is_coupled = is_coupled || !one;
    if (one) largest = std::max(largest, stability::spectral_radius(*one));
  }
  if (!is_coupled) return largest;
  // All axes as one map: blocks of the single axes, whose new commands read the errors of all of them.
  const PidMatrices feedback = written_law(*this);
  std::vector<SampledModel> models;
  std::vector<Index> before = {0}, after = {0};
  for (int axis = 0; axis < 3; ++axis) {
    models.emplace_back(at_rate(*this, with_gains(*this, axis, 0, 0, 1)));
    before.push_back(before.back() + models.back().size());
    after.push_back(after.back() + models.back().size() + 1);
  }
  MatrixXd control = MatrixXd::Zero(after.back(), before.back());
  MatrixXd hold = MatrixXd::Zero(before.back(), after.back());
  for (std::size_t i = 0; i < 3; ++i) {
    const SampledModel& block = models[i];
    control.block(after[i], before[i], block.size() + 1, block.size()) = block.control();
    hold.block(before[i], after[i], block.size(), block.size() + 1) = block.hold();
    for (std::size_t j = 0; j < 3; ++j) {
      const auto row = static_cast<Index>(i), column = static_cast<Index>(j);
      const double Ki = feedback.Ki(row, column);
      const Index command = after[i] + block.command_index();
      control(command, before[j]) = -(feedback.Kp(row, column) + Ki * gains.integrator_step_s);
      control(command, before[j] + 1) = -feedback.Kd(row, column);
      control(command, before[j] + models[j].integral_index()) = -Ki;
    }
  }
  return largest_modulus(hold * control);
}

bool FlownLoop::diverges_around_attitude() const {
  for (int axis = 0; axis < 2; ++axis) {
    const std::optional<Cascade> around = cascade(axis);
    if (around && !(cascade_margins(*around).delay_s > gains.delay_s)) return true;
    const std::optional<SampledLoop> flown = sampled_cascade(axis);
    if (flown && stability::spectral_radius(*flown) >= 1) return true;
  }
  const std::vector<int> coupled = coupled_axes();
  return gains.attitude && model.inertia_kg_m2[0] > 0 && !coupled.empty() &&
         !stability::is_stable(coupled_cascade(coupled));
}

std::optional<bool> FlownLoop::is_stable() const {
  if (diverges_around_attitude()) return false;
  if (is_sampled()) return spectral_radius() < 1;
  for (int axis = 0; axis < 3; ++axis) {
    if (const std::optional<AxisLoop> one = continuous(axis)) {
      if (!stability::is_stable(*one)) return false;
      continue;
    }
    if (gains.delay_s > 0) return std::nullopt;
    return matrix().eigenvalues().real().maxCoeff() < 0;
  }
  return true;
}

Interval FlownLoop::thrust_range_N() const {
  const double largest_N =
      plant.largest_thrust_N > 0 ? plant.largest_thrust_N : std::numeric_limits<double>::infinity();
  return {plant.thrust_scale * plant.least_thrust_N, plant.thrust_scale * largest_N};
}

double least_rotor_force_N(const ThrustMap& map) {
  const double lowest = map.c20 > 0 ? std::clamp(-(map.c10 + map.c11) / (2 * map.c20), 0.0, 1.0) : 0;
  return map.force_N(lowest, kFullBattery_V);
}

}  // namespace swarmcert::stability
