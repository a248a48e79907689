#include "analysis/learning/cross_fit.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <filesystem>

#include "analysis/learning/lipschitz_limit.h"
#include "analysis/learning/mean_network.h"
#include "analysis/run.h"
#include "lipschitz/certify.h"
#include "nn/base/input_error.h"
#include "nn/base/random.h"

namespace swarmcert::learning {
namespace {

using Eigen::Index;

constexpr int kFlights = 6, kSamples = 400;

/// Flights of a small vehicle with one or two neighbours, a smooth force, and an individual error per flight; the
/// last flight is a test flight.
LearningData flights() {
  LearningData data;
  data.layout = training::Layout(
      {{"phi:large", {6, 9, 5}, 0}, {"phi:small", {6, 10, 5}, 0}, {"rho:small", {5, 8, 7, 1}, 0}});
  files::Random random(1);
  for (int f = 0; f < kFlights; ++f) {
    TrackSamples track;
    track.flight = "walk/" + std::to_string(f);
    track.composition = "large+small>small";
    track.use = f + 1 == kFlights ? Use::kTest : Use::kFit;
    track.begin = data.samples.samples();
    const double own = 0.2 * random.symmetric();
    for (int s = 0; s < kSamples; ++s) {
      double force = own;
      for (int part = 0; part < 1 + s % 2; ++part) {
        std::vector<float> x;
        for (int k = 0; k < 6; ++k) x.push_back(static_cast<float>(random.symmetric()));
        force += std::sin(2.0 * static_cast<double>(x[0]));
        data.samples.add_input(part, x);
      }
      data.samples.add_sample(2, {static_cast<float>(force)});
    }
    track.end = data.samples.samples();
    data.tracks.push_back(track);
  }
  balance(data);
  return data;
}

RunOptions quick() {
  RunOptions options;
  options.trainer.gamma.value = 2;
  options.trainer.batch = 64;
  options.trainer.learning_rate = 5e-3;
  options.trainer.jobs = 1;
  options.epochs = 4;
  return options;
}

std::vector<training::Vector> some_members(const training::Layout& layout, std::uint64_t count) {
  std::vector<training::Vector> members;
  for (std::uint64_t seed = 1; seed <= count; ++seed)
    members.push_back(3 * training::initial_parameters(layout, seed));
  return members;
}

double norm(const training::Layout& layout, const training::Vector& theta, int part, int layer) {
  return lipschitz::spectral_norm(layout.stored(theta, part).layers[static_cast<std::size_t>(layer)], 1)
      .norm.upper.value();
}

TEST(MeanNetwork, IsTheMeanOfItsMembersAndHasLayersOfAtMostTheirNorms) {
  LearningData data = flights();
  const training::Layout one = data.layout;
  for (const std::uint64_t count : {1u, 3u, 4u}) {
    SCOPED_TRACE(count);
    const std::vector<training::Vector> members = some_members(one, count);
    data.layout = one;
    training::Matrix expected = training::Matrix::Zero(1, data.samples.samples());
    for (const training::Vector& member : members)
      expected += outputs_for(data, member, Use::kFit) / static_cast<float>(count);
    data.layout = layout_of_mean(one, static_cast<int>(count));
    const training::Vector mean = mean_network(one, members);
    const training::Matrix found = outputs_for(data, mean, Use::kFit);
    EXPECT_GT(expected.cwiseAbs().maxCoeff(), 0.1f) << "the members say something";
    EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), 1e-5f);
    for (std::size_t p = 0; p < one.parts().size(); ++p) {
      for (int layer = 0; layer < one.parts()[p].layers(); ++layer) {
        double largest = 0;
        for (const training::Vector& member : members)
          largest = std::max(largest, norm(one, member, static_cast<int>(p), layer));
        EXPECT_LE(norm(data.layout, mean, static_cast<int>(p), layer), largest * (1 + 1e-6))
            << one.parts()[p].id << " layer " << layer;
      }
    }
  }
}

TEST(MeanNetwork, IsProvedToBeNoSteeperThanItsMembersAreInTheMeanSquare) {
  const training::Layout one = flights().layout;
  const std::vector<training::Vector> members = some_members(one, 4);
  const std::vector<JointBound> mean = joint_bounds(layout_of_mean(one, 4), mean_network(one, members), 1);
  ASSERT_EQ(mean.size(), 2u);
  for (std::size_t pair = 0; pair < mean.size(); ++pair) {
    double squares = 0;
    for (const training::Vector& member : members)
      squares += std::pow(joint_bounds(one, member, 1)[pair].upper, 2) / 4;
    EXPECT_LE(mean[pair].upper, std::sqrt(squares) * (1 + 1e-3));
  }
}

TEST(CrossFit, JudgesEveryFlightByTheNetworkThatWasNotFittedToIt) {
  LearningData data = flights();
  const CrossFit fit = cross_fit(quick(), 3, data);
  ASSERT_EQ(fit.members.size(), 3u);
  // Flight 1 is in the second fold: its labels influence only the epoch of the second network.
  LearningData other = flights();
  const TrackSamples& judged = other.tracks[1];
  for (Index s = judged.begin; s < judged.end; ++s)
    other.samples.target[static_cast<std::size_t>(s)] += 0.01f;
  const CrossFit again = cross_fit(quick(), 3, other);
  ASSERT_EQ(again.members[1].best_epoch, fit.members[1].best_epoch);
  const auto of = [&](const CrossFit& some, const TrackSamples& track) {
    return training::Matrix(some.unseen.middleCols(track.begin, track.end - track.begin));
  };
  EXPECT_EQ(of(again, judged), of(fit, judged)) << "the network that judges it has not seen it";
  EXPECT_NE(of(again, other.tracks[0]), of(fit, other.tracks[0])) << "those of other folds have";
  EXPECT_EQ(of(fit, data.tracks.back()).cwiseAbs().maxCoeff(), 0) << "of flights that test it says nothing";
  for (int f = 0; f + 1 < kFlights; ++f) EXPECT_EQ(data.tracks[static_cast<std::size_t>(f)].use, Use::kFit);
  EXPECT_EQ(data.tracks.back().use, Use::kTest);
}

TEST(CrossFit, ItsMeanErrsLessThanItsMembersDoOnFlightsThatNobodySaw) {
  LearningData data = flights();
  const training::Layout one = data.layout;
  const CrossFit fit = cross_fit(quick(), 5, data);
  const double mean = rmse(data, fit.run.theta, Use::kTest, 1);
  double members = 0;
  for (std::uint64_t k = 0; k < 5; ++k) {
    LearningData left = flights();
    for (std::size_t f = 0; f + 1 < left.tracks.size(); ++f)
      left.tracks[f].use = f % 5 == k ? Use::kSelect : Use::kFit;
    balance(left);
    RunOptions options = quick();
    options.trainer.seed += k;
    members += std::pow(rmse(left, run_training(left, options).theta, Use::kTest, 1), 2) / 5;
  }
  EXPECT_LT(mean, std::sqrt(members)) << "convexity of the square, strictly where they differ";
  EXPECT_LT(mean, rmse_of_nothing(data, Use::kTest));
}

TEST(CrossFit, ThatWasStoppedGoesOnToTheSameBits) {
  const tests::ScratchFolder folder;
  RunOptions options = quick();
  options.checkpoint = folder / "checkpoint.json";
  LearningData data = flights();
  const CrossFit whole = cross_fit(options, 2, data);
  std::filesystem::remove(options.checkpoint);
  std::filesystem::remove(checkpoint_of(options, 2));

  std::atomic<bool> cancelled = false;
  options.cancelled = &cancelled;
  options.progress = [&](int done, int total, double) {
    EXPECT_EQ(total, 2 * options.epochs);
    cancelled = done == options.epochs + 2;  // in the second network
  };
  LearningData stopped = flights();
  EXPECT_TRUE(cross_fit(options, 2, stopped).run.was_cancelled);
  options.resumes = true;
  options.cancelled = nullptr;
  LearningData rest = flights();
  const CrossFit resumed = cross_fit(options, 2, rest);
  EXPECT_EQ(resumed.run.theta, whole.run.theta);
  EXPECT_EQ(resumed.unseen, whole.unseen);
}

TEST(CrossFit, KeepsTheLimitOfJointBoundsAndRefusesMoreFoldsThanFlights) {
  LearningData data = flights();
  RunOptions options = quick();
  options.max_lipschitz = 1.5;
  const CrossFit fit = cross_fit(options, 2, data);
  for (const JointBound& bound : joint_bounds(data.layout, fit.run.theta, 1)) EXPECT_LE(bound.upper, 1.5);
  LearningData few = flights();
  EXPECT_THROW(cross_fit(quick(), kFlights, few), files::InputError);
}

}  // namespace
}  // namespace swarmcert::learning
