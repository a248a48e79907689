#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>

#include "analysis/learning/lipschitz_limit.h"
#include "analysis/learning/output_scale.h"
#include "analysis/learning/training_run.h"
#include "analysis/learning/weighing.h"
#include "analysis/reproduction/nearest_labels.h"
#include "analysis/run.h"
#include "nn/base/random.h"
#include "nn/training/trainer.h"

namespace swarmcert::learning {
namespace {

using Eigen::Index;

/// Two compositions: forces around 1 gf for small vehicles and around 10 gf for large ones, with twice as many of the
/// latter.
LearningData two_compositions() {
  LearningData data;
  data.layout = training::Layout(
      {{"phi:small", {6, 10, 5}, 0}, {"rho:large", {5, 8, 1}, 0}, {"rho:small", {5, 6, 1}, 0}});
  files::Random random(1);
  for (const bool large : {true, false}) {
    TrackSamples track;
    track.composition = large ? "small>large" : "small>small";
    track.begin = data.samples.samples();
    const float weight = large ? 0.75f : 1.5f;  // the same total weight, as loaded
    for (int s = 0; s < (large ? 1600 : 800); ++s) {
      std::vector<float> x;
      for (int k = 0; k < 6; ++k) x.push_back(static_cast<float>(random.symmetric()));
      data.samples.add_input(0, x);
      data.samples.add_sample(large ? 1 : 2, {static_cast<float>((large ? 10 : 1) * random.symmetric())},
                              weight);
    }
    track.end = data.samples.samples();
    data.tracks.push_back(track);
  }
  return data;
}

TEST(Weighing, ByErrorsFollowsTheGradientOfTheMeanLogarithm) {
  LearningData data = two_compositions();
  const training::Vector theta = training::initial_parameters(data.layout, 3);
  training::Dataset weighed = data.samples;
  weighed.weight = weights_by(Weighing::kErrors, data, theta, 1);
  EXPECT_NEAR(std::accumulate(weighed.weight.begin(), weighed.weight.end(), 0.0), 2400, 0.5);
  const auto gradient_of = [&](const training::Dataset& samples, Index begin, Index end) {
    std::vector<Index> some(static_cast<std::size_t>(end - begin));
    std::iota(some.begin(), some.end(), begin);
    training::Vector gradient = training::Vector::Zero(data.layout.size());
    training::deep_set_loss(data.layout, theta, samples, some.data(), end - begin, &gradient);
    return gradient;
  };
  // d/dtheta sum_c log MSE_c = sum_c (d MSE_c / d theta) / MSE_c.
  training::Dataset plain = data.samples;
  plain.weight.assign(plain.weight.size(), 1.0f);
  training::Vector expected = training::Vector::Zero(data.layout.size());
  for (const TrackSamples& track : data.tracks) {
    const double error = errors_by_group(data, theta, Use::kFit, 1, 1).at(track.group());
    expected += gradient_of(plain, track.begin, track.end) /
                static_cast<float>(error * static_cast<double>(track.end - track.begin));
  }
  const training::Vector found = gradient_of(weighed, 0, 2400);
  // Errors are computed from every eighth sample, so the direction is accurate to a few percent.
  EXPECT_GT(found.normalized().dot(expected.normalized()), 0.99f);
}

TEST(Weighing, ScenariosOfOneCompositionHaveErrorsOfTheirOwn) {
  LearningData data = two_compositions();
  for (TrackSamples& track : data.tracks) track.composition = "small>small";
  data.tracks[0].scenario = "swap";
  data.tracks[1].scenario = "randomwalk";
  const training::Vector nothing = training::Vector::Zero(data.layout.size());
  const auto errors = errors_by_group(data, nothing, Use::kFit, 1, 1);
  ASSERT_EQ(errors.size(), 2u);
  EXPECT_NEAR(errors.at("swap small>small") / errors.at("randomwalk small>small"), 100, 15)
      << "of 10 gf and of 1";
}

/// One neighbour at random positions; the label is a function of height and lateral distance only, plus `offset_gf`.
void add_flight(LearningData& data, Use use, double offset_gf, double outwards_m, files::Random& random) {
  TrackSamples track;
  track.flight = std::string("swap/") + name(use);
  track.vehicle = "cf1";
  track.composition = "small>small";
  track.use = use;
  track.begin = data.samples.samples();
  for (int s = 0; s < (use == Use::kTest ? 2000 : 40000); ++s) {
    const double r = outwards_m + 0.2 * random.uniform(), dz = 0.3 + 0.1 * random.uniform();
    const double angle = 3.14159 * random.symmetric();
    data.samples.add_input(0, {static_cast<float>(r * std::cos(angle)),
                               static_cast<float>(r * std::sin(angle)), static_cast<float>(dz), 0, 0, 0});
    data.samples.add_sample(2, {static_cast<float>(-8 * std::exp(-100 * r * r) + 5 * dz + offset_gf)});
  }
  track.end = data.samples.samples();
  data.tracks.push_back(track);
}

/// Targets of the compositions are `gain` times the output of the network plus an independent error.
LearningData selecting(const training::Vector& theta, const std::map<std::string, double>& gains) {
  LearningData data = two_compositions();
  files::Random random(4);
  for (TrackSamples& track : data.tracks) {
    track.use = Use::kSelect;
    for (Index s = track.begin; s < track.end; ++s) {
      const double f = training::predict(data.layout, theta, data.samples, &s, 1)(0, 0);
      data.samples.target[static_cast<std::size_t>(s)] =
          static_cast<float>(gains.at(track.composition) * f + 0.1 * random.symmetric());
    }
  }
  return data;
}

/// The samples of a track.
std::vector<Index> samples_of(const TrackSamples& track) {
  std::vector<Index> samples(static_cast<std::size_t>(track.end - track.begin));
  std::iota(samples.begin(), samples.end(), track.begin);
  return samples;
}

/// Mean squares of the targets of a track, and of their residuals given `outputs`.
std::pair<double, double> mean_squares(const LearningData& data, const TrackSamples& track,
                                       const training::Matrix& outputs) {
  double nothing = 0, network = 0;
  for (const Index s : samples_of(track)) {
    nothing += data.samples.target_of(s).cast<double>().squaredNorm();
    network += (data.samples.target_of(s) - outputs.col(s)).cast<double>().squaredNorm();
  }
  const auto count = static_cast<double>(track.end - track.begin);
  return {nothing / count, network / count};
}

TEST(OutputSupport, MinimisesTheErrorOfTheSelectingFlightsAndLeavesNoCompositionWorseThanWithout) {
  const training::Vector theta = training::initial_parameters(two_compositions().layout, 3);
  // Half of the output is right for large vehicles; for small ones the output has the wrong sign.
  const LearningData data = selecting(theta, {{"small>large", 0.5}, {"small>small", -0.3}});
  const training::Matrix outputs = outputs_for(data, theta, Use::kSelect);
  const OutputSupport support = output_support(data, outputs, outputs);
  EXPECT_NEAR(support.scales.at("large"), 0.5, 0.02);
  EXPECT_EQ(support.scales.at("small"), 0);
  EXPECT_EQ(support.silent_names(), std::vector<std::string>{"small>small"});

  training::Vector scaled = theta;
  scale_outputs(data.layout, support.scales, scaled);
  training::Matrix kept = outputs_for(data, scaled, Use::kSelect);
  silence(data, support, kept);
  for (const TrackSamples& track : data.tracks) {
    EXPECT_LT(mean_squares(data, track, kept).second, mean_squares(data, track, outputs).second);
    EXPECT_LE(mean_squares(data, track, kept).second, mean_squares(data, track, kept).first * (1 + 1e-6));
    EXPECT_NEAR(std::sqrt(mean_squares(data, track, kept).second), support.left.at(track.composition).network,
                1e-5);
  }
}

TEST(OutputSupport, OneCompositionThatTheOutputHarmsIsSilentAndTheOthersKeepTheirs) {
  const training::Vector theta = training::initial_parameters(two_compositions().layout, 3);
  LearningData data = selecting(theta, {{"small>large", 0.9}, {"small>small", 1.0}});
  // Half of the large vehicles' samples become a composition in which only a tenth of the output is right.
  TrackSamples harmed = data.tracks[0];
  harmed.begin = (harmed.begin + harmed.end) / 2;
  harmed.composition = "large+small>large";
  data.tracks[0].end = harmed.begin;
  for (const Index s : samples_of(harmed)) data.samples.target[static_cast<std::size_t>(s)] *= 0.1f;
  data.tracks.push_back(harmed);
  const training::Matrix outputs = outputs_for(data, theta, Use::kSelect);
  const OutputSupport support = output_support(data, outputs, outputs);
  EXPECT_NEAR(support.scales.at("large"), 0.9, 0.02) << "as if the other did not exist";
  EXPECT_NEAR(support.scales.at("small"), 1, 0.02);
  ASSERT_EQ(support.silent_names(), std::vector<std::string>{"large+small>large"});
  const auto [nothing, network] = mean_squares(data, harmed, outputs);
  EXPECT_NEAR(support.silent.begin()->second.nothing, std::sqrt(nothing), 1e-6);
  EXPECT_NEAR(support.silent.begin()->second.network, std::sqrt(network), 1e-6);
  EXPECT_GT(network, nothing);

  // No other scale, with the compositions that it helps, leaves a smaller total error.
  const auto left = [&](double scale) {
    double sum = 0;
    for (const TrackSamples& track : data.tracks) {
      if (track.composition.back() != 'e') continue;  // large
      const auto [none, with] = mean_squares(data, track, static_cast<float>(scale) * outputs);
      sum += std::min(none, with);
    }
    return sum;
  };
  for (double scale = 0; scale <= 1; scale += 0.05)
    EXPECT_LE(left(support.scales.at("large")), left(scale) * (1 + 1e-4)) << scale;
}

TEST(OutputSupport, WithoutScalesItSilencesWhatAllOfTheOutputHarms) {
  const training::Vector theta = training::initial_parameters(two_compositions().layout, 3);
  const LearningData data = selecting(theta, {{"small>large", 0.6}, {"small>small", 0.4}});
  const training::Matrix outputs = outputs_for(data, theta, Use::kSelect);
  const OutputSupport support = output_support(data, outputs, outputs, Use::kSelect, Support::kSilence);
  EXPECT_TRUE(support.scales.empty());
  EXPECT_EQ(support.silent_names(), std::vector<std::string>{"small>small"}) << "twice 0.4 is below 1";
}

TEST(OutputSupport, OfAMeanTheErrorsOfSingleNetworksDoNotCount) {
  const training::Vector theta = training::initial_parameters(two_compositions().layout, 3);
  const LearningData data = selecting(theta, {{"small>large", 1.0}, {"small>small", 1.0}});
  const training::Matrix mean = outputs_for(data, theta, Use::kSelect);
  // The output of one of many networks: the mean plus an individual error of the same magnitude.
  training::Matrix one = mean;
  files::Random random(6);
  for (Index s = 0; s < one.cols(); ++s)
    if (random.below(2) == 0)
      one(0, s) *= 2;
    else
      one(0, s) = 0;
  EXPECT_NEAR(output_support(data, one, one).scales.at("large"), 0.5, 0.05);
  const OutputSupport support = output_support(data, one, mean);
  EXPECT_NEAR(support.scales.at("large"), 1, 0.1);
  const SupportedErrors as_trained =
      output_support(data, one, one, Use::kSelect, Support::kAsTrained).left.at("small>large");
  EXPECT_NEAR(as_trained.network, as_trained.nothing, 0.1 * as_trained.nothing) << "of a single network";
  EXPECT_NEAR(support.left.at("small>large").network, 0.1 / std::sqrt(3), 0.006) << "what the targets err by";
}

TEST(NearestLabels, SeeTheMeanOfAFlightThroughAnyTurnAndNothingWhereNobodyFlew) {
  LearningData data = two_compositions();
  data.tracks.clear();
  files::Random random(5);
  add_flight(data, Use::kFit, 0, 0, random);
  add_flight(data, Use::kTest, -2, 0, random);
  const auto found = reproduction::nearest_labels(data);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NEAR(found.at({"swap/test", "cf1"}).mean_gf, -2, 0.1);
  EXPECT_NEAR(found.at({"swap/test", "cf1"}).rms_gf, 2, 0.2);
  LearningData elsewhere = two_compositions();
  elsewhere.tracks.clear();
  add_flight(elsewhere, Use::kFit, 0, 0, random);
  add_flight(elsewhere, Use::kTest, -2, 1, random);
  EXPECT_TRUE(reproduction::nearest_labels(elsewhere).empty());
}

TEST(LipschitzLimit, ScaledNetworksAreProvedToKeepItAndNothingElseChanges) {
  const LearningData data = two_compositions();
  const training::Vector before = 4 * training::initial_parameters(data.layout, 3);
  training::Vector theta = before;
  const std::vector<JointBound> loose = joint_bounds(data.layout, theta, 1);
  ASSERT_EQ(loose.size(), 2u);
  const double limit = 0.5 * std::min(loose[0].upper, loose[1].upper);
  limit_joint_bounds(limit, data.layout, 1, theta);
  for (const JointBound& bound : joint_bounds(data.layout, theta, 1)) {
    EXPECT_LE(bound.upper, limit);
    EXPECT_GE(bound.upper, 0.999 * limit);
  }
  Index changed = 0;
  for (Index i = 0; i < theta.size(); ++i) changed += theta[i] != before[i];
  EXPECT_LE(changed, 8 + 6) << "the last weights of both rho";
  training::Vector again = theta;
  limit_joint_bounds(limit, data.layout, 1, again);
  EXPECT_EQ(again, theta) << "what keeps the limit stays";
}

constexpr training::Layers kBoundedLayers[] = {training::Layers::kAol, training::Layers::kOrthogonal,
                                               training::Layers::kSandwich};

TEST(LipschitzLimit, BoundedLayersWithTheSharesOfTheirProductAreProvedToKeepItForAnyParameters) {
  // Parts of one to three layers: phi of three and rho of two, phi of one and rho of two.
  const training::Layout layout(
      {{"phi:large", {6, 5}}, {"phi:small", {6, 10, 7, 5}}, {"rho:small", {5, 8, 1}}});
  const files::GammaStatement gamma = {3, files::GammaStatement::Scope::kLayer,
                                       files::GammaStatement::Mode::kClip};
  constexpr double kLimit = 2;
  for (const training::Layers layers : kBoundedLayers) {
    training::BoundedLayers bounded(layout, layers, gamma);
    bounded.tighten(shares_of_product(kLimit, layers, gamma, layout));
    double largest = 0;
    for (const double scale : {0.3, 1.0, 3.0}) {
      const training::Vector theta =
          bounded.weights(static_cast<float>(scale) * training::initial_parameters(layout, 5));
      for (const JointBound& bound : joint_bounds(layout, theta, 1)) {
        EXPECT_LE(bound.upper, kLimit * (1 + 1e-4)) << static_cast<int>(layers) << " scale " << scale;
        largest = std::max(largest, bound.upper);
      }
    }
    EXPECT_GT(largest, 0.2 * kLimit) << "the limit is not out of reach";
  }
}

TEST(RunTraining, WithBoundedLayersKeepsTheLimitAndGoesOnToTheSameBits) {
  LearningData data = two_compositions();
  for (int t = 0; t < 2; ++t) {  // the last quarter of each selects
    TrackSamples rest = data.tracks[t];
    rest.use = Use::kSelect;
    rest.begin += 3 * (rest.end - rest.begin) / 4;
    data.tracks[t].end = rest.begin;
    data.tracks.push_back(rest);
  }
  const tests::ScratchFolder folder;
  for (const training::Layers layers : kBoundedLayers) {
    RunOptions options;
    options.trainer.gamma.value = 3;
    options.trainer.layers = layers;
    options.trainer.batch = 256;
    options.trainer.jobs = 1;
    options.max_lipschitz = 3;
    options.epochs = 5;
    const learning::Run whole = run_training(data, options);
    for (const JointBound& bound : joint_bounds(data.layout, whole.theta, 1)) EXPECT_LE(bound.upper, 3);

    std::atomic<bool> cancelled = false;
    options.cancelled = &cancelled;
    options.progress = [&](int done, int, double) { cancelled = done == 2; };
    options.checkpoint = folder / "checkpoint.json";
    EXPECT_TRUE(run_training(data, options).was_cancelled);
    options.cancelled = nullptr;
    options.resumes = true;
    options.trainer.jobs = 2;
    EXPECT_EQ(run_training(data, options).theta, whole.theta) << static_cast<int>(layers);
  }
}

TEST(LipschitzLimit, AsksForTheLayersThatHaveAHandInTheLargestBound) {
  const LearningData data = two_compositions();
  training::Vector theta = 4 * training::initial_parameters(data.layout, 3);
  const std::vector<JointBound> bounds = joint_bounds(data.layout, theta, 1);
  const bool first = bounds[0].upper > bounds[1].upper;
  const double limit = std::sqrt(bounds[0].upper * bounds[1].upper);  // one above, one below
  const Tightening asked = scale_to(limit, data.layout, 1, theta);
  EXPECT_LT(asked.shares[0], 1) << "phi has a hand in both";
  EXPECT_LT(asked.shares[static_cast<std::size_t>(bounds[first ? 0 : 1].rho)], 1);
  EXPECT_GT(asked.shares[static_cast<std::size_t>(bounds[first ? 1 : 0].rho)], 1);
  EXPECT_NEAR(std::pow(asked.shares[0], 4) * asked.largest, limit, 1e-9 * limit) << "two layers of each";
}

}  // namespace
}  // namespace swarmcert::learning
