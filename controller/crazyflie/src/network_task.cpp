#include "network_task.h"

#include "controller/neighbours.h"
#include "shared.h"
#include "swarmcert_network.h"
#include "upstream.h"
#include "vehicles.h"

namespace swarmcert::crazyflie {
namespace {

using controller::Vector3;

static_assert(swarmcert_network::kTakesRelativeState,
              "the app provides relative position and velocity, but this network has other inputs");
static_assert(swarmcert_network::kInputs == controller::kNeighbourInputs);
static_assert(swarmcert_network::kMostNeighbours >= PEER_LOCALIZATION_MAX_NEIGHBORS,
              "export with --most-neighbours of at least PEER_LOCALIZATION_MAX_NEIGHBORS");
static_assert(PEER_LOCALIZATION_MAX_NEIGHBORS <= controller::kMostNeighbours);

constexpr int kPeers = PEER_LOCALIZATION_MAX_NEIGHBORS;

struct Peer {
  std::uint8_t id = 0;
  controller::NeighbourTrack<float> track;
};

Peer peers[kPeers];
Vector3<float> last_effect_W_N{};

// The position of the time stamp in a peer's data differs between firmware versions.
template <typename Position>
auto stamp_of(const Position& peer, int) -> decltype(peer.timestamp) {
  return peer.timestamp;
}
template <typename Position>
auto stamp_of(const Position& peer, long) -> decltype(peer.pos.timestamp) {
  return peer.pos.timestamp;
}

/// Reads data that the radio task writes without a lock, until two readings agree. Returns false if they do not.
bool read_peer(int index, std::uint8_t& id, Vector3<float>& position_W_m, std::uint32_t& stamp_ms) {
  const volatile auto* const peer = peerLocalizationGetPositionByIdx(static_cast<std::uint8_t>(index));
  if (peer == nullptr) return false;
  const auto read = [&] {
    id = peer->id;
    stamp_ms = stamp_of(*peer, 0);
    position_W_m = {peer->pos.x, peer->pos.y, peer->pos.z};
  };
  read();
  for (int attempt = 0; attempt < 3; ++attempt) {
    const std::uint8_t id_before = id;
    const std::uint32_t stamp_before = stamp_ms;
    const Vector3<float> before = position_W_m;
    read();
    const bool agree =
        id == id_before && stamp_ms == stamp_before && nn::bits(position_W_m.x) == nn::bits(before.x) &&
        nn::bits(position_W_m.y) == nn::bits(before.y) && nn::bits(position_W_m.z) == nn::bits(before.z);
    if (agree) return id != 0;
  }
  return false;
}

void update_tracks() {
  for (int i = 0; i < kPeers; ++i) {
    std::uint8_t id = 0;
    std::uint32_t stamp_ms = 0;
    Vector3<float> position_W_m;
    if (!read_peer(i, id, position_W_m, stamp_ms)) continue;
    if (id != peers[i].id) peers[i] = {id, {}};
    peers[i].track.kind = kind_of(id);
    controller::update(peers[i].track, {}, position_W_m, stamp_ms);
  }
}

/// The estimator's state of this vehicle, independent of the active controller.
class OwnState {
 public:
  Vector3<float> position_W_m() const { return read(position_); }
  Vector3<float> velocity_W_m_s() const { return read(velocity_); }

 private:
  struct Ids {
    logVarId_t x, y, z;
  };
  // Some firmware versions declare the names as char*; none modifies them.
  static logVarId_t find(const char* name) {
    return logGetVarId(const_cast<char*>("stateEstimate"), const_cast<char*>(name));
  }
  static Vector3<float> read(const Ids& ids) {
    return {logGetFloat(ids.x), logGetFloat(ids.y), logGetFloat(ids.z)};
  }

  Ids position_{find("x"), find("y"), find("z")};
  Ids velocity_{find("vx"), find("vy"), find("vz")};
};

void publish(const controller::Prediction<float>& prediction, std::uint32_t now_ms) {
  last_effect_W_N = prediction.effect_W_N;
  swarmcert_status.prediction = static_cast<std::uint8_t>(prediction.status);
  swarmcert_status.neighbours = static_cast<std::uint8_t>(prediction.used + prediction.fading);
  swarmcert_status.predicted_N = prediction.effect_W_N.z;
  swarmcert_status.predicted_ms = now_ms;
}

}  // namespace

bool passes_self_test() {
  if (swarmcert_status.self_test == kSwarmcertUntested) {
    switch (swarmcert_network::self_test(nullptr)) {
      case swarmcert_network::SelfTest::kPassed:
        swarmcert_status.self_test = kSwarmcertPassed;
        break;
      case swarmcert_network::SelfTest::kFusedArithmetic:
        swarmcert_status.self_test = kSwarmcertFused;
        break;
      case swarmcert_network::SelfTest::kOtherBits:
        swarmcert_status.self_test = kSwarmcertOtherBits;
        break;
      case swarmcert_network::SelfTest::kOtherWeights:
        swarmcert_status.self_test = kSwarmcertOtherWeights;
        break;
    }
  }
  return swarmcert_status.self_test == kSwarmcertPassed;
}

void step_network(std::uint32_t now_ms) {
  update_tracks();
  const std::uint8_t enable = swarmcert_parameters.enable;
  const int own_kind = swarmcert_parameters.own_kind;
  const bool runs = (enable == kSwarmcertComputeOnly || enable == kSwarmcertApply) && passes_self_test() &&
                    own_kind < swarmcert_network::kOwnKinds;
  if (!runs) return publish({}, now_ms);

  static const OwnState own;
  static controller::NeighbourTrack<float> tracks[kPeers];
  for (int i = 0; i < kPeers; ++i) tracks[i] = peers[i].track;
  controller::PredictionSettings<float> settings;
  settings.newton_per_unit = 1.0f;
  // The function that is certified, exported and tested; there is no other evaluation in the image.
  const auto evaluate = [own_kind](const float* state, const nn::Neighbour<float>* neighbours, int count,
                                   float* force_N) {
    return swarmcert_network::predict_force_z(own_kind, state, neighbours, count, force_N);
  };
  const std::uint64_t begin_us = usecTimestamp();
  const controller::Prediction<float> prediction = controller::predict_with(
      evaluate, settings, own.position_W_m(), own.velocity_W_m_s(), tracks, kPeers, now_ms, last_effect_W_N);
  const std::uint64_t took_us = usecTimestamp() - begin_us;
  swarmcert_status.network_us = static_cast<std::uint16_t>(took_us < 65535 ? took_us : 65535);
  publish(prediction, now_ms);
}

}  // namespace swarmcert::crazyflie

extern "C" void appMain() {
  swarmcert::crazyflie::passes_self_test();
  TickType_t woken = xTaskGetTickCount();
  for (;;) {
    vTaskDelayUntil(&woken, M2T(swarmcert::crazyflie::kPeriod_ms));
    swarmcert::crazyflie::step_network(xTaskGetTickCount());
  }
}
