#include "analysis/firmware/golden_flight.h"

#include <algorithm>
#include <iterator>
#include <limits>

#include "nn/base/random.h"

namespace swarmcert::firmware {
namespace {

constexpr std::uint32_t kPeriod_ms = 10;
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

/// Values that the controller must not use.
struct Invalid {
  std::array<float, 3> Tick::*member;
  float value;
};
constexpr Invalid kInvalid[] = {{&Tick::state_position_m, kNaN}, {&Tick::state_position_m, 2000},
                                {&Tick::state_velocity_m_s, 60}, {&Tick::position_m, kNaN},
                                {&Tick::position_m, -1500},      {&Tick::velocity_m_s, -70},
                                {&Tick::acceleration_m_s2, 90},  {&Tick::rates_deg_s, 9000}};

/// Draws the inputs of one period after another. A period of 10 ms has one call of the task and five of the
/// controller, of which one falls on a skipped tick.
class FlightWriter {
 public:
  FlightWriter(const AppParameters& normal, std::uint64_t seed) : normal_(normal), random_(seed) {
    tick_.now_ms = static_cast<std::uint32_t>(random_.bits());  // what depends on the time may come late
    for (int i = 0; i < kAppPeers; ++i) tick_.peers[i].id = static_cast<std::uint8_t>(201 + i);
  }

  std::vector<Tick> run(int periods) {
    for (int period = 0; period < periods; ++period) {
      tick_.now_ms += kPeriod_ms;
      tick_.parameters = normal_;
      tick_.parameters.enable = 2;
      tick_.initialises = period % 40 == 0;
      move_vehicle(period);
      move_peers(period);
      disturb(period);
      add(true);
      tick_.now_ms += late_ms_;
      for (int call = 0; call < 5; ++call) {
        turn();
        tick_.step = static_cast<std::uint32_t>(10 * period + 2 * call + (call == 3 ? 1 : 0));
        add(false);
        tick_.initialises = false;
      }
    }
    return std::move(ticks_);
  }

 private:
  float within(float range) { return range * static_cast<float>(random_.symmetric()); }
  template <std::size_t kN>
  std::array<float, kN> vector(float range) {
    std::array<float, kN> x;
    for (float& one : x) one = within(range);
    return x;
  }

  /// Mostly near the set point, every fourth period so far away that motors saturate.
  void move_vehicle(int period) {
    const float size = period % 4 == 3 ? 3.0f : 0.1f;
    tick_.position_m = vector<3>(1);
    tick_.position_m[2] += 1.5f;
    tick_.velocity_m_s = vector<3>(0.5f);
    tick_.acceleration_m_s2 = vector<3>(1);
    tick_.yaw_deg = within(180);
    tick_.rates_deg_s = vector<3>(60);
    tick_.thrust = 0;
    tick_.modes = {1, 1, 1, 1, 0};
    tick_.wanted_quaternion = {within(0.2f), within(0.2f), within(1), 1};
    tick_.state_position_m = tick_.position_m;
    for (float& x : tick_.state_position_m) x += within(size);
    tick_.state_velocity_m_s = vector<3>(size);
    std::copy_n(tick_.state_position_m.begin(), 3, tick_.estimate.begin());
    std::copy_n(tick_.state_velocity_m_s.begin(), 3, tick_.estimate.begin() + 3);
    tick_.battery_V = 3.7f + within(0.5f);
  }

  /// The attitude between calls of the controller.
  void turn() {
    const float size = random_.below(5) == 0 ? 1.0f : 0.1f;
    tick_.state_quaternion = {within(size), within(size), within(1), 1};
    tick_.gyro_deg_s = vector<3>(300 * size);
  }

  /// Peers move so slowly that their velocities are known. Groups of periods: no peers, a few inside the box, all
  /// inside, some in the fading zone, some fast, some silent for longer than they count.
  void move_peers(int period) {
    const int group = period / 12 % 6;
    for (int i = 0; i < kAppPeers; ++i) {
      AppPeer& peer = tick_.peers[static_cast<std::size_t>(i)];
      const bool is_silent = group == 0 || (group == 1 && i > 2) || (group == 5 && i % 2 == 0);
      if (is_silent) continue;
      const float reach = group == 3 ? 1.0f : group == 2 ? 0.6f : 0.9f;
      const float phase = static_cast<float>(period + 7 * i) * (group == 4 ? 0.2f : 0.02f);
      for (std::size_t k = 0; k < 3; ++k) {
        const float wave = phase + static_cast<float>(k) * 0.37f;
        const float saw = 2 * (wave - static_cast<float>(static_cast<int>(wave))) - 1;
        peer.position_W_m[k] = tick_.state_position_m[k] + reach * (k == 2 ? 0.9f : 1.0f) * saw;
      }
      peer.stamp_ms = tick_.now_ms - static_cast<std::uint32_t>(i);
    }
    if (group == 5 && period % 12 == 11) tick_.now_ms += 450;  // those that fell silent fade out
  }

  /// Every invalid input, every mode and every switch in turn; half of the periods are undisturbed.
  void disturb(int period) {
    self_test_of_task_ = self_test_of_controller_ = kSelfTestPassed;
    late_ms_ = 0;
    if (period % 2 == 0) return;
    const std::size_t axis = static_cast<std::size_t>(period / 2) % 3;
    const std::size_t kind = static_cast<std::size_t>(period / 2) % 25;
    if (kind < std::size(kInvalid)) {
      (tick_.*kInvalid[kind].member)[axis] = kInvalid[kind].value;
      return;
    }
    switch (kind) {
      case 8:
        tick_.battery_V = axis == 0 ? 0.0f : axis == 1 ? 9.0f : kNaN;
        break;
      case 9:
        tick_.estimate[axis] = kNaN;
        break;
      case 10:
        tick_.estimate[axis] = 1e9f;
        break;
      case 11:
        tick_.estimate[3 + axis] = kNaN;
        break;
      case 12:
        tick_.peers[axis].position_W_m[axis] = kNaN;
        break;
      case 13:
        tick_.peers[axis].position_W_m[axis] = 5000;
        break;
      case 14:
        tick_.modes[axis] = 2;
        break;
      case 15:
        tick_.modes[axis] = 0;
        break;
      case 16:
        tick_.modes = {0, 0, 0, 0, 0};
        break;
      case 17:
        tick_.modes = {0, 0, 0, 0, 0};
        tick_.thrust = 1;
        break;
      case 18:
        tick_.modes[3] = 2;
        break;
      case 19:
        tick_.modes[4] = 1;
        break;
      case 20:
        tick_.parameters.enable = static_cast<std::uint8_t>(axis == 2 ? 3 : axis);
        break;
      case 21:
        tick_.parameters.own_kind = 200;
        break;
      case 22:
        self_test_of_task_ = axis == 0 ? kSelfTestFailed : kSelfTestPassed;
        self_test_of_controller_ = kSelfTestFailed;
        break;
      case 23:
        tick_.parameters.mass_kg *= 1.3f;
        for (float& gain : tick_.parameters.gains) gain *= 1 + within(0.3f);
        break;
      default:  // the task is late: predictions count for 100 ms
        late_ms_ = axis == 0 ? 100 : axis == 1 ? 101 : 300;
        break;
    }
  }

  void add(bool is_of_network) {
    tick_.is_of_network = is_of_network;
    tick_.self_test = is_of_network ? self_test_of_task_ : self_test_of_controller_;
    if (!is_of_network && random_.below(16) == 0) tick_.state_quaternion[random_.below(4)] = kNaN;
    if (!is_of_network && random_.below(16) == 0) tick_.gyro_deg_s[random_.below(3)] = 9000;
    ticks_.push_back(tick_);
  }

  static constexpr std::uint8_t kSelfTestPassed = 1, kSelfTestFailed = 3;

  std::uint8_t self_test_of_task_ = kSelfTestPassed, self_test_of_controller_ = kSelfTestPassed;
  std::uint32_t late_ms_ = 0;
  AppParameters normal_;
  files::Random random_;
  Tick tick_;
  std::vector<Tick> ticks_;
};

}  // namespace

std::vector<Tick> golden_flight(const AppParameters& normal, int periods, std::uint64_t seed) {
  return FlightWriter(normal, seed).run(periods);
}

}  // namespace swarmcert::firmware
