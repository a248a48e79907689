/// @file Runs every function used in flight with random and boundary vectors; the resulting words are the same on
/// every machine.
#pragma once

#include <cstdint>
#include <initializer_list>

#include "../controller/rotors_on_circle.h"
#include "controller/flight_controller.h"
#include "controller/gain_conversion.h"
#include "controller/neighbours.h"
#include "flight_case.h"
#include "networks.h"
#include "nn/deep_set.h"

namespace swarmcert::tests {

using controller::Vector3;

/// Runs `vectors` vectors and passes every result to `sink(std::uint32_t)` as its bits. All NaNs are passed as the
/// same word, because processors differ only in which NaN an invalid operation produces.
///
/// Each random number is drawn in a statement of its own, because the evaluation order of the arguments of a call is
/// unspecified and compilers differ.
template <typename Sink>
class Workload {
 public:
  explicit Workload(Sink& sink) : sink_(sink) {
    const auto next = [this] { return unit(); };
    phi_small_.fill(next);
    phi_large_.fill(next);
    ground_.fill(next);
    rho_.fill(next);
  }

  void run(int vectors) {
    sink_(nn::arithmetic_is_fused() ? 1u : 0u);
    for (const int count : {3, 4, 6, 8}) {
      const auto a = controller::allocation(controller::rotors_on_circle(count, 0.046f, 0.3f, 0.006f));
      for (const auto& row : a.inverse) {
        for (const float entry : row) put(entry);
      }
    }
    for (int i = 0; i < vectors; ++i) {
      boundary_ = i % 8 == 0;
      networks(i);
      trigonometry();
      laws();
      motors();
      flight(i);
    }
  }

 private:
  // --- input ---
  std::uint32_t bits() {  // xorshift32 (Marsaglia 2003)
    state_ ^= state_ << 13;
    state_ ^= state_ >> 17;
    state_ ^= state_ << 5;
    return state_;
  }
  /// In [-1, 1), a multiple of 2^-23.
  float unit() { return static_cast<float>(static_cast<std::int32_t>(bits() >> 8) - (1 << 23)) * 0x1p-23f; }
  /// In [-largest, largest); in a boundary vector occasionally an invalid or extreme value.
  float number(float largest) {
    static constexpr std::uint32_t kStrange[] = {0x7fc00000u, 0x7f800000u, 0xff800000u, 0x7f7fffffu,
                                                 0x00000001u, 0x80000000u, 0x007fffffu, 0x00800000u,
                                                 0x3f800000u, 0xbf800000u};
    const float regular = nn::rounded(largest * unit());
    if (!boundary_ || bits() % 16 != 0) return regular;
    float strange;
    std::memcpy(&strange, &kStrange[bits() % 10], sizeof strange);
    return strange;
  }
  Vector3<float> vector(float largest) {
    Vector3<float> v;
    v.x = number(largest);
    v.y = number(largest);
    v.z = number(largest);
    return v;
  }
  controller::Matrix3<float> rotation() {
    Vector3<float> axis;
    axis.x = unit();
    axis.y = unit();
    axis.z = unit() + 1.1f;
    const auto heading = controller::heading_of_yaw(nn::rounded(3.1f * unit()));
    return controller::attitude_of_axis(controller::divided(axis, controller::norm(axis)), heading).R_WR;
  }

  // --- output ---
  void put(float x) {
    std::uint32_t pattern = nn::bits(x);
    if ((pattern & 0x7fffffffu) > 0x7f800000u) pattern = 0x7fc00000u;
    sink_(pattern);
  }
  void put(const Vector3<float>& v) { put(v.x), put(v.y), put(v.z); }

  // --- functions used in flight ---
  void networks(int i) {
    nn::Neighbour<float> neighbours[controller::kMostNeighbours];
    float inputs[controller::kMostNeighbours][6], own[4], output[kHidden];
    for (float& x : own) x = number(2);
    const int count = i % (controller::kMostNeighbours + 1);
    for (int j = 0; j < count; ++j) {
      for (float& x : inputs[j]) x = number(1);
      neighbours[j] = {inputs[j], static_cast<int>(bits() % 2)};
    }
    float x[6];
    for (float& entry : x) entry = number(1);
    nn::evaluate(phi_small_.mlp(), x, output, scratch_);
    for (const float y : output) put(y);
    nn::evaluate(rho_.mlp(), output, output, scratch_ + 2 * kHidden);
    put(output[0]);

    const nn::Mlp<float> phi[2] = {phi_small_.mlp(), phi_large_.mlp()}, ground = ground_.mlp();
    const nn::DeepSet<float> set{&ground, phi, 2, rho_.mlp(), nullptr, nullptr};
    const nn::DeepSetWorkspace<float> workspace{inputs_, order_, controller::kMostNeighbours, sum_, scratch_};
    for (int shuffle = 0; shuffle < 2; ++shuffle) {
      float y = 0;
      sink_(static_cast<std::uint32_t>(nn::evaluate(set, own, neighbours, count, &y, workspace)));
      put(y);
      for (int j = count - 1; j > 0; --j) {
        const auto k = static_cast<int>(bits() % static_cast<std::uint32_t>(j + 1));
        const nn::Neighbour<float> other = neighbours[j];
        neighbours[j] = neighbours[k];
        neighbours[k] = other;
      }
    }
    if (i % 4 != 0) return;
    for (int j = 0; j < count; ++j) {
      controller::NeighbourTrack<float>& track = tracks_[j];
      track.kind = static_cast<int>(bits() % 2);
      const std::uint32_t stamp_ms = 1000u * static_cast<std::uint32_t>(i) + bits() % 600u;
      const Vector3<float> first = vector(1), second = vector(1);
      const std::uint32_t later_ms = stamp_ms + 10 + bits() % 200u;
      controller::update(track, {}, first, stamp_ms);
      sink_(static_cast<std::uint32_t>(controller::update(track, {}, second, later_ms)));
    }
    const Vector3<float> position = vector(0.5f), velocity = vector(1);
    const auto prediction = controller::predict(set, {}, position, velocity, tracks_, count,
                                                1000u * static_cast<std::uint32_t>(i) + 900u, {}, workspace);
    sink_(static_cast<std::uint32_t>(prediction.status));
    put(prediction.effect_W_N.z);
    put(prediction.jump_N);
  }

  void trigonometry() {
    const auto s = controller::sin_cos(number(110));
    put(s.sine);
    put(s.cosine);
    put(controller::square_root(number(10)));
  }

  void laws() {
    const controller::TrackingError<float> error{vector(0.5f), vector(1)};
    const controller::FeedForward<float> forward{vector(3), vector(0.1f)};
    const Vector3<float> integral = vector(0.1f);
    const Vector3<float> force =
        controller::desired_force(settings_.position, settings_.mass_kg, error, integral, forward);
    put(force);
    const controller::CompositeGains<float> composite{{{4, 0.3f, 0}, {0.3f, 4, 0}, {0, 0, 3}},
                                                      {{.136f, .01f, 0}, {.01f, .136f, 0}, {0, 0, .2f}}};
    put(controller::desired_force(composite, settings_.mass_kg, error, integral, forward));
    put(controller::integrate(settings_.integrator, integral, error.position_m,
                              controller::held_axes(composite, error.position_m, force, true)));
    const controller::PidGains<float>& pid = settings_.position;
    const controller::AxisPid<float> pid_x{pid.Kp_1_s2.x, pid.Kd_1_s.x, pid.Ki_1_s3.x};
    const auto conversion = controller::to_composite(pid_x, settings_.mass_kg, 1e-3f);
    put(conversion.lambda_1_s);
    put(conversion.needed_Ki_1_s3);

    const auto heading = controller::heading_of_yaw(number(4));
    const auto fallback = rotation();
    const auto desired = controller::desired_attitude(force, heading, fallback, 0.01f);
    sink_(static_cast<std::uint32_t>(desired.which));
    put(desired.R_WR.x), put(desired.R_WR.y), put(desired.R_WR.z);
    controller::AttitudeState<float> state;
    state.R_WB = rotation();
    state.omega_B_rad_s = vector(10);
    put(controller::collective_thrust(controller::ThrustRule::kProjected, force, state.R_WB));
    const Vector3<float> omega_R = vector(3), omega_dot_R = vector(20);
    const auto attitude = controller::attitude_error(state, {desired.R_WR, omega_R, omega_dot_R});
    put(controller::lee_torque(settings_.lee, settings_.inertia_kg_m2, state, attitude));
    const auto sigma = controller::modified_rodrigues(attitude.R_RB);
    put(sigma);
    const auto rate = controller::reference_rate(settings_.robust.Lambda_1_s, sigma, attitude);
    const Vector3<float> rate_integral = vector(2);
    put(controller::robust_torque(settings_.robust, settings_.inertia_kg_m2, state.omega_B_rad_s, rate,
                                  rate_integral));
  }

  void motors() {
    const float volts = nn::rounded(0.5f * number(1)) + 3.7f, mean_p = number(1);
    const float most = controller::largest_force(settings_.largest_force, mean_p, volts);
    put(most);
    controller::Wrench<float> wanted;
    wanted.thrust_N = number(0.7f);
    wanted.torque_N_m = vector(0.02f);
    const auto mixed = controller::mix(settings_.allocation, {0.005f, most}, wanted);
    put(mixed.thrust_N), put(mixed.roll_pitch_share), put(mixed.yaw_share);
    for (int k = 0; k < 4; ++k) {
      const float force = mixed.forces.at_N[k];
      put(force);
      const float p = controller::pwm_of_force(settings_.thrust_map, force, volts);
      put(p);
      put(controller::force_of_pwm(settings_.thrust_map, p, volts));
      sink_(controller::pwm_register(p));
    }
    sink_(controller::pwm_register(number(2)));
  }

  void flight(int i) {
    controller::Measured<float> measured{};
    measured.position_W_m = vector(1);
    measured.velocity_W_m_s = vector(1);
    measured.attitude.R_WB = rotation();
    measured.attitude.omega_B_rad_s = vector(5);
    measured.battery_V = nn::rounded(0.4f * number(1)) + 3.8f;
    controller::FlightReference<float> reference{};
    reference.position_W_m = vector(0.8f);
    reference.heading = controller::heading_of_yaw(number(3));
    settings_.attitude_law = i % 2 == 0 ? controller::AttitudeLaw::kLee : controller::AttitudeLaw::kRobust;
    const Vector3<float> effect = vector(0.1f);
    const auto command =
        controller::flight_step(settings_, memory_, measured, reference, effect, 0u, i % 5 == 0);
    sink_(command.faults);
    put(command.wanted.thrust_N);
    put(command.wanted.torque_N_m);
    for (const std::uint16_t pwm : command.pwm) sink_(pwm);
  }

  Sink& sink_;
  std::uint32_t state_ = 2463534242u;
  bool boundary_ = false;
  FourLayers<6, 25, kHidden> phi_small_;
  FourLayers<6, 15, kHidden> phi_large_;  // blocks of 8, 4, 2 and 1
  FourLayers<4, 25, kHidden, nn::Layout::kRows> ground_;
  FourLayers<kHidden, kHidden, 1> rho_;
  Settings settings_ = crazyflie_settings();
  controller::FlightMemory<float> memory_;
  controller::NeighbourTrack<float> tracks_[controller::kMostNeighbours];
  float inputs_[controller::kMostNeighbours * 6], sum_[kHidden], scratch_[12 * kHidden];
  int order_[controller::kMostNeighbours];
};

}  // namespace swarmcert::tests
