#include "controller/neighbours.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <set>
#include <vector>

#include "random_vectors.h"

namespace swarmcert::controller {
namespace {

constexpr float kNotANumber = std::numeric_limits<float>::quiet_NaN();

/// A deep set of small random networks with two kinds and a ground term.
class Networks {
 public:
  explicit Networks(unsigned seed) {
    std::mt19937 generator(seed);
    for (std::vector<float>* numbers : {&ground_, &small_, &large_, &rho_}) {
      for (float& w : *numbers) w = static_cast<float>(tests::uniform(generator, -0.5, 0.5));
    }
  }

  nn::DeepSet<float> set() const { return {&ground_mlp_, phi_.data(), 2, rho_mlp_, nullptr, nullptr}; }
  nn::DeepSetWorkspace<float> workspace() {
    return {inputs_.data(), order_.data(), kMostNeighbours, sum_.data(), scratch_.data()};
  }

 private:
  static constexpr int kWide = 12, kHidden = 8;
  using Layers = std::array<nn::DenseLayer<float>, 2>;
  static std::vector<float> room(int inputs, int outputs) {
    return std::vector<float>(static_cast<std::size_t>((inputs + 1) * kWide + (kWide + 1) * outputs));
  }
  static Layers layers(const std::vector<float>& n, int inputs, int outputs) {
    const float* const second = n.data() + (inputs + 1) * kWide;
    return {nn::DenseLayer<float>{n.data(), n.data() + inputs * kWide, kWide, inputs},
            nn::DenseLayer<float>{second, second + kWide * outputs, outputs, kWide}};
  }

  std::vector<float> ground_ = room(kOwnInputs, kHidden), small_ = room(kNeighbourInputs, kHidden),
                     large_ = room(kNeighbourInputs, kHidden), rho_ = room(kHidden, 1);
  Layers ground_layers_ = layers(ground_, kOwnInputs, kHidden),
         small_layers_ = layers(small_, kNeighbourInputs, kHidden),
         large_layers_ = layers(large_, kNeighbourInputs, kHidden), rho_layers_ = layers(rho_, kHidden, 1);
  nn::Mlp<float> ground_mlp_{ground_layers_.data(), 2}, rho_mlp_{rho_layers_.data(), 2};
  std::array<nn::Mlp<float>, 2> phi_{nn::Mlp<float>{small_layers_.data(), 2}, {large_layers_.data(), 2}};
  std::array<float, std::size_t{kMostNeighbours} * kNeighbourInputs> inputs_{};
  std::array<int, kMostNeighbours> order_{};
  std::array<float, kHidden> sum_{};
  std::vector<float> scratch_ = std::vector<float>(static_cast<std::size_t>(scratch_size(set())));
};

class NeighboursTest : public testing::Test {
 protected:
  NeighbourTrack<float> track(const Vector3<float>& position, std::uint32_t stamp_ms = 10000) {
    NeighbourTrack<float> t;
    t.position_W_m = position;
    t.velocity_W_m_s = tests::cast<float>(tests::random_vector(generator_, 1));
    t.stamp_ms = stamp_ms;
    t.velocity_since_ms = 0;
    t.kind = static_cast<int>(generator_() % 2);
    t.has_position = t.has_velocity = true;
    return t;
  }
  Vector3<float> random_position() { return tests::cast<float>(tests::random_vector(generator_, 0.95)); }

  Prediction<float> predicted(const std::vector<NeighbourTrack<float>>& tracks,
                              std::uint32_t now_ms = 10000) {
    return predict(networks_.set(), settings_, {}, {0.1f, 0.2f, -0.1f}, tracks.data(),
                   static_cast<int>(tracks.size()), now_ms, {}, networks_.workspace());
  }

  std::mt19937 generator_{20};
  Networks networks_{21};
  PredictionSettings<float> settings_{{}, 9.81e-3f, 10.0f};
};

std::uint32_t bits(const Prediction<float>& p) { return nn::bits(p.effect_W_N.z); }

TEST_F(NeighboursTest, OrderLeavesTheBitsUnchangedAlsoWhileNeighboursFade) {
  int fading = 0;
  for (int i = 0; i < 300; ++i) {
    std::vector<NeighbourTrack<float>> tracks;
    for (int j = 0; j < 6; ++j) {
      tracks.push_back(track(random_position(), 10000 - static_cast<std::uint32_t>(generator_() % 520)));
    }
    if (i % 3 == 0) tracks[1] = tracks[0];  // equal neighbours
    const Prediction<float> first = predicted(tracks);
    ASSERT_EQ(first.status, PredictionStatus::kOk);
    fading += first.fading;
    for (int n = 0; n < 10; ++n) {
      std::shuffle(tracks.begin(), tracks.end(), generator_);
      EXPECT_EQ(bits(predicted(tracks)), bits(first));
    }
  }
  EXPECT_GT(fading, 200);
}

TEST_F(NeighboursTest, WithFullWeightsItIsTheDeepSetBitForBit) {
  std::vector<NeighbourTrack<float>> tracks;
  for (int j = 0; j < 4; ++j)
    tracks.push_back(track(tests::cast<float>(tests::random_vector(generator_, 0.8))));
  const Prediction<float> p = predicted(tracks);
  ASSERT_EQ(p.used, 4);
  ASSERT_EQ(p.fading, 0);
  std::array<std::array<float, 6>, 4> inputs;
  std::vector<nn::Neighbour<float>> neighbours;
  for (std::size_t j = 0; j < 4; ++j) {
    const Vector3<float> x = tracks[j].position_W_m, v = tracks[j].velocity_W_m_s;
    inputs[j] = {x.x, x.y, x.z, v.x - 0.1f, v.y - 0.2f, v.z + 0.1f};
    neighbours.push_back({inputs[j].data(), tracks[j].kind});
  }
  const std::array<float, 4> own{-0.0f, -0.1f, -0.2f, 0.1f};
  float output = 0;
  ASSERT_EQ(nn::evaluate(networks_.set(), own.data(), neighbours.data(), 4, &output, networks_.workspace()),
            nn::DeepSetStatus::kOk);
  EXPECT_EQ(p.effect_W_N.z, output * 9.81e-3f);
}

TEST_F(NeighboursTest, StaleAndUnknownNeighboursChangeNothing) {
  const std::vector<NeighbourTrack<float>> fresh = {track({0.1f, 0.2f, 0.3f})};
  std::vector<NeighbourTrack<float>> with = fresh;
  with.push_back(track({0.1f, 0.0f, 0.3f}, 10000 - 500));
  with.push_back(track({0.0f, 0.0f, 1.5f}));
  with.push_back(track({0.1f, 0.1f, 0.1f}));
  with.back().has_velocity = false;
  EXPECT_EQ(bits(predicted(with)), bits(predicted(fresh)));
  EXPECT_EQ(predicted(with).used, 1);
}

// A neighbour that leaves the box, becomes stale, and is found again: small steps in, small steps out.
TEST_F(NeighboursTest, ForceIsContinuousAcrossEveryCutOff) {
  settings_.cut_offs.fade_m = 0.1f;
  const std::vector<NeighbourTrack<float>> two = {track({0.1f, 0.2f, 0.3f}), track({0.5f, 0.1f, 0.2f})};
  const float whole_jump = std::fabs(predicted({two[0]}).effect_W_N.z - predicted(two).effect_W_N.z);
  ASSERT_GT(whole_jump, 1e-4f);

  const auto largest_step = [&](int steps, auto scene) {
    float worst = 0, last = predicted(scene(0)).effect_W_N.z;
    for (int i = 1; i <= steps; ++i) {
      const float now = predicted(scene(i)).effect_W_N.z;
      worst = std::fmax(worst, std::fabs(now - last));
      last = now;
    }
    EXPECT_EQ(last, predicted({two[0]}).effect_W_N.z) << "the neighbour must be gone in the end";
    return worst;
  };
  // 1 mm steps from inside to outside. The bound exceeds the 1 % of the fade, since the network's own slope also moves
  // the force.
  NeighbourTrack<float> leaving = two[1];
  const float slope_step = largest_step(600, [&](int i) {
    leaving.position_W_m.x = 0.5f + 0.001f * static_cast<float>(i);
    return std::vector<NeighbourTrack<float>>{two[0], leaving};
  });
  EXPECT_LE(slope_step, 0.05f * whole_jump);

  NeighbourTrack<float> ageing = two[1];
  const float age_step = largest_step(120, [&](int i) {
    ageing.stamp_ms = 10000 - 390 - static_cast<std::uint32_t>(i);
    return std::vector<NeighbourTrack<float>>{two[0], ageing};
  });
  EXPECT_LE(age_step, 0.0101f * whole_jump + 1e-7f);

  NeighbourTrack<float> found = two[1];
  found.velocity_since_ms = 10000;
  const float joining = predicted({two[0], found}).effect_W_N.z - predicted({two[0]}).effect_W_N.z;
  EXPECT_LE(std::fabs(joining), 0.0101f * whole_jump + 1e-7f);
}

// A neighbour that makes the composition silent removes the whole force: during the fade, or at once.
TEST_F(NeighboursTest, WhereANeighbourMakesTheSetSilentAllOfTheForceFadesAndTheStepIsNeverMoreThanAllOfIt) {
  std::vector<NeighbourTrack<float>> two = {track({0.1f, 0.2f, 0.3f}), track({0.5f, 0.1f, 0.2f})};
  two[0].kind = 0, two[1].kind = 1;
  constexpr std::array<int, 2> kBoth = {1, 1};
  nn::DeepSet<float> set = networks_.set();
  set.silent = kBoth.data(), set.num_silent = 1;
  const auto force = [&](const std::vector<NeighbourTrack<float>>& tracks) {
    return predict(set, settings_, {}, {0.1f, 0.2f, -0.1f}, tracks.data(), static_cast<int>(tracks.size()),
                   10000, {}, networks_.workspace());
  };
  const float alone = force({two[0]}).effect_W_N.z;
  ASSERT_GT(std::fabs(alone), 1e-4f);
  EXPECT_EQ(alone, predicted({two[0]}).effect_W_N.z);
  EXPECT_EQ(bits(force(two)), 0u);
  settings_.cut_offs.fade_m = 0.1f;
  float last = 0;
  for (int i = 0; i <= 600; ++i) {  // the second neighbour leaves in steps of 1 mm
    two[1].position_W_m.x = 0.5f + 0.001f * static_cast<float>(i);
    const float now = force(two).effect_W_N.z;
    EXPECT_LE(std::fabs(now - last), 0.0101f * std::fabs(alone)) << i;
    EXPECT_LE(std::fabs(now), std::fabs(alone) * 1.00001f);
    last = now;
  }
  EXPECT_EQ(last, alone);
  settings_.cut_offs.fade_m = 0, settings_.cut_offs.fade_ms = 0;
  two[1].position_W_m.x = 0.999f;
  EXPECT_EQ(predict(set, settings_, {}, {0.1f, 0.2f, -0.1f}, two.data(), 2, 10000, force({two[0]}).effect_W_N,
                    networks_.workspace())
                .jump_N,
            std::fabs(alone));
}

TEST_F(NeighboursTest, HardCutOffsReportTheirJump) {
  settings_.cut_offs.fade_m = 0;
  settings_.cut_offs.fade_ms = 0;
  NeighbourTrack<float> t = track({0.999f, 0, 0});
  const Prediction<float> inside = predicted({t});
  EXPECT_EQ(inside.used, 1);
  t.position_W_m.x = 1.0f;
  const Prediction<float> outside = predict(networks_.set(), settings_, {}, {0.1f, 0.2f, -0.1f}, &t, 1, 10000,
                                            inside.effect_W_N, networks_.workspace());
  EXPECT_EQ(outside.used + outside.fading, 0);
  EXPECT_EQ(outside.jump_N, std::fabs(outside.effect_W_N.z - inside.effect_W_N.z));
  EXPECT_GT(outside.jump_N, 0.0f);
}

TEST_F(NeighboursTest, FadedForceStaysBetweenTheForcesItFadesBetween) {
  for (int i = 0; i < 500; ++i) {
    const std::vector<NeighbourTrack<float>> both = {
        track({0.1f, 0.2f, 0.3f}),
        track({0.2f, 0.1f, 0.1f}, 9600 - static_cast<std::uint32_t>(generator_() % 100))};
    std::vector<NeighbourTrack<float>> full = both;
    full[1].stamp_ms = 10000;
    const float a = predicted({both[0]}).effect_W_N.z, b = predicted(full).effect_W_N.z;
    const float f = predicted(both).effect_W_N.z;
    EXPECT_GE(f, std::fmin(a, b) - 1e-7f);
    EXPECT_LE(f, std::fmax(a, b) + 1e-7f);
  }
}

TEST_F(NeighboursTest, WhateverIsWrongThePredictionIsZeroWithAStatus) {
  const NeighbourTrack<float> good = track({0.1f, 0.2f, 0.3f});
  NeighbourTrack<float> bad = good;
  bad.kind = 7;
  Prediction<float> p = predicted({good, bad});
  EXPECT_EQ(p.status, PredictionStatus::kNetworkFailed);
  EXPECT_EQ(p.network, nn::DeepSetStatus::kUnknownKind);
  EXPECT_EQ(bits(p), 0u);

  p = predicted(std::vector<NeighbourTrack<float>>(11, good));
  EXPECT_EQ(p.status, PredictionStatus::kTooManyNeighbours);
  EXPECT_EQ(bits(p), 0u);

  p = predict(networks_.set(), settings_, {kNotANumber, 0, 0}, {}, &good, 1, 10000, {0, 0, 0.5f},
              networks_.workspace());
  EXPECT_EQ(p.status, PredictionStatus::kOwnStateInvalid);
  EXPECT_EQ(bits(p), 0u);
  EXPECT_EQ(p.jump_N, 0.5f);

  nn::DeepSet<float> wrong = networks_.set();
  wrong.phi = wrong.ground;
  p = predict(wrong, settings_, {}, {}, &good, 1, 10000, {}, networks_.workspace());
  EXPECT_EQ(p.status, PredictionStatus::kWrongNetwork);
}

TEST_F(NeighboursTest, NoNetworkMayAskForMoreThanTheLimit) {
  settings_.newton_per_unit = 1e6f;
  settings_.largest_force_N = 0.2f;
  EXPECT_EQ(std::fabs(predicted({track({0.1f, 0.2f, 0.3f})}).effect_W_N.z), 0.2f);
}

TEST(Velocity, ConvergesToThatOfAMovingNeighbour) {
  NeighbourTrack<float> t;
  const VelocityFilter<float> filter;
  EXPECT_EQ(update(t, filter, {0, 0, 1}, 1000), TrackStatus::kStarted);
  EXPECT_FALSE(t.has_velocity);
  for (std::uint32_t i = 1; i <= 100; ++i) {
    const float s = 0.01f * static_cast<float>(i);
    EXPECT_EQ(update(t, filter, {0.5f * s, -s, 1}, 1000 + 10 * i), TrackStatus::kUpdated);
  }
  EXPECT_NEAR(t.velocity_W_m_s.x, 0.5f, 1e-4);
  EXPECT_NEAR(t.velocity_W_m_s.y, -1.0f, 1e-4);
  EXPECT_EQ(t.velocity_W_m_s.z, 0.0f);
}

TEST(Velocity, JumpsAreHeldRepeatsIgnoredAndGapsStartAgain) {
  NeighbourTrack<float> t;
  const VelocityFilter<float> filter{0.0f, 2.0f};
  update(t, filter, {0, 0, 1}, 1000);
  update(t, filter, {5, -5, 1}, 1010);
  EXPECT_EQ(t.velocity_W_m_s.x, 2.0f);
  EXPECT_EQ(t.velocity_W_m_s.y, -2.0f);
  EXPECT_EQ(update(t, filter, {6, 0, 1}, 1010), TrackStatus::kRepeated);
  EXPECT_EQ(update(t, filter, {6, 0, 1}, 900), TrackStatus::kRepeated);
  EXPECT_EQ(t.position_W_m.x, 5.0f);
  EXPECT_EQ(update(t, filter, {kNotANumber, 0, 1}, 1020), TrackStatus::kNotFinite);
  EXPECT_EQ(update(t, filter, {2000, 0, 1}, 1020), TrackStatus::kOutOfRange);
  EXPECT_EQ(t.stamp_ms, 1010u);
  EXPECT_EQ(update(t, filter, {5, 0, 1}, 1511), TrackStatus::kStarted);
  EXPECT_FALSE(t.has_velocity);
}

TEST(Velocity, MillisecondCounterMayWrap) {
  NeighbourTrack<float> t;
  const VelocityFilter<float> filter{0.0f, 2.0f};
  update(t, filter, {0, 0, 0}, 0xfffffff6u);
  EXPECT_EQ(update(t, filter, {0.01f, 0, 0}, 0x0000000au), TrackStatus::kUpdated);
  EXPECT_NEAR(t.velocity_W_m_s.x, 0.5f, 1e-6);
  EXPECT_EQ(age_ms(5, 0xffffffffu), 6u);
  EXPECT_EQ(age_ms(5, 7), 0u);
}

}  // namespace
}  // namespace swarmcert::controller
