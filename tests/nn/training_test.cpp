#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <cmath>
#include <numeric>

#include "nn/training/deep_set_loss.h"
#include "nn/training/layout.h"
#include "nn/training/spectral_normalization.h"
#include "nn/training/symmetry.h"
#include "nn/training/trainer.h"

namespace swarmcert::training {
namespace {

using Eigen::Index;

/// Two kinds of neighbours, a ground term with four inputs, two kinds of vehicles, two outputs.
Layout mixed_layout() {
  return Layout({{"phi:ground", {4, 9, 5}, 0, {{1, 2}}},
                 {"phi:large", {6, 8, 7, 5}, 0, {{0, 1}, {3, 4}}},
                 {"phi:small", {6, 10, 5}, 0, {{0, 1}, {3, 4}}},
                 {"rho:large", {5, 8, 2}, 0},
                 {"rho:small", {5, 6, 6, 2}, 0}});
}

std::vector<float> random_values(int count, files::Random& random) {
  std::vector<float> values;
  for (int i = 0; i < count; ++i) values.push_back(static_cast<float>(random.symmetric()));
  return values;
}

/// Samples with 0 to 3 neighbours of either kind, most with a ground term, weights in [0, 2].
Dataset mixed_dataset(int samples, std::uint64_t seed) {
  files::Random random(seed);
  Dataset data;
  data.outputs = 2;
  for (int s = 0; s < samples; ++s) {
    if (s % 5 != 0) data.add_input(0, random_values(4, random));
    for (std::uint64_t j = random.below(4); j > 0; --j)
      data.add_input(1 + static_cast<int>(random.below(2)), random_values(6, random));
    data.add_sample(3 + s % 2, random_values(2, random), static_cast<float>(1 + random.symmetric()));
  }
  return data;
}

std::vector<Index> all_samples(const Dataset& data) {
  std::vector<Index> samples(static_cast<std::size_t>(data.samples()));
  std::iota(samples.begin(), samples.end(), Index{0});
  return samples;
}

/// Returns the loss in double by the evaluator that is certified and flown, which shares no code with training.
double evaluator_loss(const std::vector<files::Weights>& parts, const Dataset& data) {
  std::vector<files::Evaluator<double>> evaluators;
  for (const files::Weights& part : parts) evaluators.emplace_back(part);
  double loss = 0;
  for (Index s = 0; s < data.samples(); ++s) {
    std::vector<double> sum(static_cast<std::size_t>(parts[data.rho[s]].inputs()), 0.0);
    for (Index i = data.first[s]; i < data.first[s + 1]; ++i) {
      const float* x = data.x.data() + i * data.width;
      const std::vector<double> feature = evaluators[data.phi[i]]({x, x + parts[data.phi[i]].inputs()});
      for (std::size_t k = 0; k < sum.size(); ++k) sum[k] += feature[k];
    }
    const std::vector<double> output = evaluators[data.rho[s]](sum);
    for (int k = 0; k < data.outputs; ++k) {
      const double error = output[k] - static_cast<double>(data.target[s * data.outputs + k]);
      loss += static_cast<double>(data.weight[s]) * error * error;
    }
  }
  return loss;
}

std::vector<files::Weights> stored_parts(const Layout& layout, const Vector& theta) {
  std::vector<files::Weights> parts;
  for (std::size_t p = 0; p < layout.parts().size(); ++p)
    parts.push_back(layout.stored(theta, static_cast<int>(p)));
  return parts;
}

TEST(DeepSetLoss, IsThatOfTheEvaluator) {
  const Layout layout = mixed_layout();
  const Vector theta = initial_parameters(layout, 7);
  const Dataset data = mixed_dataset(300, 1);
  const double expected = evaluator_loss(stored_parts(layout, theta), data);
  const std::vector<Index> samples = all_samples(data);
  EXPECT_NEAR(deep_set_loss(layout, theta, data, samples.data(), 300, nullptr), expected, 1e-5 * expected);
}

TEST(DeepSetLoss, GradientIsTheDerivativeInEveryParameter) {
  const Layout layout = mixed_layout();
  const Vector theta = initial_parameters(layout, 11);
  const Dataset data = mixed_dataset(40, 2);
  const std::vector<Index> samples = all_samples(data);
  Vector gradient = Vector::Zero(layout.size());
  deep_set_loss(layout, theta, data, samples.data(), data.samples(), &gradient);

  std::vector<files::Weights> parts = stored_parts(layout, theta);
  const double step = 1e-6;
  const double tolerance = 1e-4 * static_cast<double>(gradient.cwiseAbs().maxCoeff());
  int compared = 0;
  for (std::size_t p = 0; p < parts.size(); ++p) {
    for (std::size_t k = 0; k < parts[p].layers.size(); ++k) {
      files::Layer& layer = parts[p].layers[k];
      const auto derivative = [&](double& parameter) {
        const double before = parameter;
        parameter = before + step;
        const double above = evaluator_loss(parts, data);
        parameter = before - step;
        const double below = evaluator_loss(parts, data);
        parameter = before;
        ++compared;
        return (above - below) / (2 * step);
      };
      const auto w = layout.weights(gradient, static_cast<int>(p), static_cast<int>(k));
      const auto b = layout.biases(gradient, static_cast<int>(p), static_cast<int>(k));
      for (int i = 0; i < layer.outputs; ++i) {
        for (int j = 0; j < layer.inputs; ++j) {
          const std::size_t at = static_cast<std::size_t>(i) * layer.inputs + j;
          ASSERT_NEAR(static_cast<double>(w(i, j)), derivative(layer.weights[at]), tolerance)
              << layout.parts()[p].id << " layer " << k << " weight " << i << ", " << j;
        }
        ASSERT_NEAR(static_cast<double>(b(i)), derivative(layer.biases[i]), tolerance)
            << layout.parts()[p].id << " layer " << k << " bias " << i;
      }
    }
  }
  EXPECT_EQ(compared, layout.size());
}

/// Returns the x and y components of all horizontal vectors among a sample's inputs.
std::vector<Eigen::Vector2f> horizontal_vectors(const Layout& layout, const Dataset& data, Index sample) {
  std::vector<Eigen::Vector2f> vectors;
  for (Index i = data.first[sample]; i < data.first[sample + 1]; ++i) {
    for (const auto& [x, y] : layout.parts()[data.phi[i]].horizontal)
      vectors.emplace_back(data.x[i * data.width + x], data.x[i * data.width + y]);
  }
  return vectors;
}

TEST(Symmetry, TurnedSamplesKeepHeightsAndWhatTheirVectorsAreToOneAnother) {
  const Layout layout = mixed_layout();
  const Dataset data = mixed_dataset(500, 6);
  Dataset turned = data;
  files::Random random(1);
  turn_about_vertical(layout, data, random, turned);
  int moved = 0, mirrored = 0, pairs = 0;
  for (Index s = 0; s < data.samples(); ++s) {
    const std::vector<Eigen::Vector2f> before = horizontal_vectors(layout, data, s),
                                       after = horizontal_vectors(layout, turned, s);
    const auto cross = [](const Eigen::Vector2f& a, const Eigen::Vector2f& b) {
      return a.x() * b.y() - a.y() * b.x();
    };
    float orientation = 0;  // orientation of the first two vectors, which determines that of all
    for (std::size_t i = 0; i < before.size(); ++i) {
      moved += (after[i] - before[i]).norm() > 0.01f;
      for (std::size_t j = i; j < before.size(); ++j) {
        EXPECT_NEAR(after[i].dot(after[j]), before[i].dot(before[j]), 1e-5f) << s;
        if (std::abs(cross(before[i], before[j])) < 1e-3f) continue;
        const float sign = cross(after[i], after[j]) / cross(before[i], before[j]);
        EXPECT_NEAR(std::abs(sign), 1, 1e-2f) << s;
        if (orientation == 0) {
          orientation = sign;
          ++pairs;
          mirrored += sign < 0;
        }
        EXPECT_GT(sign * orientation, 0) << s << ": one vector was mirrored without the others";
      }
    }
    for (Index i = data.first[s]; i < data.first[s + 1]; ++i) {
      const int z = layout.parts()[data.phi[i]].inputs() == 4 ? 0 : 2;
      EXPECT_EQ(turned.x[i * data.width + z], data.x[i * data.width + z]);
    }
  }
  EXPECT_GT(moved, 1000);
  EXPECT_GT(mirrored, pairs / 3);
  EXPECT_LT(mirrored, 2 * pairs / 3);
}

/// The force is dp and the torque is dp x dv; both relations must hold after rotating and mirroring the inputs.
TEST(Symmetry, TargetsTurnWithTheInputsTorquesAsAxialVectors) {
  const Layout layout({{"phi:small", {6, 4, 3}, 0, {{0, 1}, {3, 4}}}, {"rho:small", {3, 4, 3}, 0}});
  for (const bool is_torque : {false, true}) {
    const auto law = [&](const float* x) -> Eigen::Vector3f {
      const Eigen::Vector3f dp(x[0], x[1], x[2]), dv(x[3], x[4], x[5]);
      return is_torque ? Eigen::Vector3f(dp.cross(dv)) : dp;
    };
    files::Random random(3);
    Dataset data;
    data.outputs = 3;
    data.target_is_axial = is_torque;
    for (int s = 0; s < 200; ++s) {
      const std::vector<float> x = random_values(6, random);
      const Eigen::Vector3f y = law(x.data());
      data.add_input(0, x);
      data.add_sample(1, {y.x(), y.y(), y.z()});
    }
    Dataset turned = data;
    turn_about_vertical(layout, data, random, turned);
    for (Index s = 0; s < data.samples(); ++s)
      EXPECT_LT((turned.target_of(s) - law(turned.x.data() + s * turned.width)).norm(), 1e-5f) << s;
  }
}

TEST(Layout, LoadsWhatItStored) {
  const Layout layout = mixed_layout();
  const Vector theta = initial_parameters(layout, 5);
  Vector again = Vector::Zero(layout.size());
  const std::vector<files::Weights> parts = stored_parts(layout, theta);
  for (std::size_t p = 0; p < parts.size(); ++p) layout.load(again, static_cast<int>(p), parts[p]);
  EXPECT_EQ(again, theta);
  EXPECT_THROW(layout.load(again, 0, parts[1]), std::invalid_argument);
}

TrainerOptions options_with(double gamma, files::GammaStatement::Scope scope,
                            files::GammaStatement::Mode mode) {
  TrainerOptions options;
  options.gamma = {gamma, scope, mode};
  options.batch = 256;
  options.turns = true;
  options.jobs = 1;
  return options;
}

constexpr Layers kAllLayers[] = {Layers::kFree, Layers::kAol, Layers::kOrthogonal, Layers::kSandwich};

using Scope = files::GammaStatement::Scope;
using Mode = files::GammaStatement::Mode;

double norm_of(const Layout& layout, const Vector& theta, int part, int layer) {
  return layout.weights(theta, part, layer).cast<double>().eval().jacobiSvd().singularValues()(0);
}

TEST(SpectralNormalization, ClipKeepsEveryLayerBelowGamma) {
  const Layout layout = mixed_layout();
  const Dataset data = mixed_dataset(600, 3);
  Trainer trainer(layout, data, all_samples(data), 3 * initial_parameters(layout, 1),
                  options_with(0.8, Scope::kLayer, Mode::kClip));
  for (int epoch = 0; epoch < 20; ++epoch) trainer.run_epoch(epoch, 1e-3);
  int at_limit = 0;
  for (int p = 0; p < 5; ++p) {
    for (int k = 0; k < layout.parts()[p].layers(); ++k) {
      const double norm = norm_of(layout, trainer.theta(), p, k);
      EXPECT_LE(norm, 0.8 * 1.01) << layout.parts()[p].id << " layer " << k;
      at_limit += norm > 0.8 * 0.99;
    }
  }
  EXPECT_GT(at_limit, 0);
}

TEST(SpectralNormalization, TightenedLayersKeepTheirShareOfGamma) {
  const Layout layout = mixed_layout();
  const Dataset data = mixed_dataset(600, 3);
  Trainer trainer(layout, data, all_samples(data), 3 * initial_parameters(layout, 1),
                  options_with(0.8, Scope::kLayer, Mode::kClip));
  trainer.tighten({1, 1, 0.5, 1, 0.25});
  for (int epoch = 0; epoch < 20; ++epoch) trainer.run_epoch(epoch, 1e-3);
  const double limits[] = {0.8, 0.8, 0.4, 0.8, 0.2};
  for (int p = 0; p < 5; ++p) {
    for (int k = 0; k < layout.parts()[p].layers(); ++k)
      EXPECT_LE(norm_of(layout, trainer.theta(), p, k), limits[p] * 1.01) << layout.parts()[p].id;
  }
  EXPECT_GT(norm_of(layout, trainer.theta(), 0, 0), 0.41) << "a part that was not tightened";
}

TEST(SpectralNormalization, EqualMakesTheProductOfTheNormsGamma) {
  const Layout layout = mixed_layout();
  const Dataset data = mixed_dataset(600, 3);
  Trainer trainer(layout, data, all_samples(data), initial_parameters(layout, 1),
                  options_with(2.0, Scope::kNetwork, Mode::kEqual));
  for (int epoch = 0; epoch < 5; ++epoch) trainer.run_epoch(epoch, 1e-3);
  for (int p = 0; p < 5; ++p) {
    const int layers = layout.parts()[p].layers();
    for (int k = 0; k < layers; ++k) {
      EXPECT_NEAR(norm_of(layout, trainer.theta(), p, k), std::pow(2.0, 1.0 / layers), 0.01)
          << layout.parts()[p].id << " layer " << k;
    }
  }
}

TEST(Adam, StepIsTheFormulaInFloatToTheBit) {
  files::Random random(31);
  constexpr int kSize = 1001;
  Adam adam(kSize);
  Vector theta = Vector::Zero(kSize), expected = theta, m = theta, v = theta;
  for (int step = 1; step <= 20; ++step) {
    Vector gradient(kSize);
    for (Index i = 0; i < kSize; ++i) gradient(i) = static_cast<float>(std::pow(random.symmetric(), 5));
    adam.step(theta, gradient, 1e-3);
    const auto first = static_cast<float>(1e-3 / (1 - std::pow(0.9, step)));
    const auto second = static_cast<float>(1 / (1 - std::pow(0.999, step)));
    for (Index i = 0; i < kSize; ++i) {
      m(i) = 0.9f * m(i) + 0.1f * gradient(i);
      v(i) = 0.999f * v(i) + 0.001f * (gradient(i) * gradient(i));
      expected(i) -= first * m(i) / (std::sqrt(second * v(i)) + 1e-8f);
    }
    ASSERT_EQ(theta, expected) << "step " << step << ": training would depend on the processor";
  }
}

/// Returns the weights after three epochs.
Vector trained(const Layout& layout, const Dataset& data, const TrainerOptions& options) {
  Trainer trainer(layout, data, all_samples(data), initial_parameters(layout, 1), options);
  for (int epoch = 0; epoch < 3; ++epoch) trainer.run_epoch(epoch, 1e-2);
  return trainer.theta();
}

TEST(Trainer, SameBitsForAnyNumberOfThreads) {
  const Layout layout = mixed_layout();
  const Dataset data = mixed_dataset(900, 4);
  for (const Layers layers : kAllLayers) {
    std::vector<Vector> results;
    for (const int jobs : {1, 2, 5}) {
      TrainerOptions options = options_with(2, Scope::kLayer, Mode::kClip);
      options.layers = layers;
      options.batch = 700;
      options.jobs = jobs;
      results.push_back(trained(layout, data, options));
    }
    EXPECT_EQ(results[0], results[1]);
    EXPECT_EQ(results[0], results[2]);
  }
}

TEST(Trainer, SameBitsForAnySizeOfTheProcessorsCaches) {
  const Layout layout = mixed_layout();
  const Dataset data = mixed_dataset(900, 4);
  for (const Layers layers : kAllLayers) {
    std::vector<Vector> results;
    for (const int l1_bytes : {4 << 10, 32 << 10, 48 << 10}) {
      Eigen::setCpuCacheSizes(l1_bytes, 16 * l1_bytes, 64 * l1_bytes);
      TrainerOptions options = options_with(2, Scope::kLayer, Mode::kClip);
      options.layers = layers;
      results.push_back(trained(layout, data, options));
    }
    EXPECT_EQ(results[0], results[1]);
    EXPECT_EQ(results[0], results[2]);
  }
}

TEST(Trainer, ARunThatWasTakenUpAgainEndsWithTheSameBits) {
  const Layout layout = mixed_layout();
  const Dataset data = mixed_dataset(500, 4);
  for (const Layers layers : kAllLayers) {
    TrainerOptions options = options_with(2, Scope::kLayer, Mode::kClip);
    options.layers = layers;
    Trainer whole(layout, data, all_samples(data), initial_parameters(layout, 1), options);
    for (int epoch = 0; epoch < 4; ++epoch) whole.run_epoch(epoch, 1e-2);

    Trainer first(layout, data, all_samples(data), initial_parameters(layout, 1), options);
    for (int epoch = 0; epoch < 2; ++epoch) first.run_epoch(epoch, 1e-2);
    Trainer second(layout, data, all_samples(data), initial_parameters(layout, 99), options);
    second.restore(first.state());
    EXPECT_EQ(second.theta(), first.theta());
    for (int epoch = 2; epoch < 4; ++epoch) second.run_epoch(epoch, 1e-2);
    EXPECT_EQ(second.theta(), whole.theta());
    EXPECT_THROW(second.restore(Vector::Zero(3)), std::invalid_argument);
  }
}

TEST(Trainer, TurnsLetItPredictDirectionsThatItNeverSaw) {
  // f = 1 if the neighbour is beside the vehicle and 0 if it is far away; recorded to the east only.
  const Layout layout({{"phi:default", {6, 16, 8}, 0, {{0, 1}, {3, 4}}}, {"rho:default", {8, 16, 1}, 0}});
  files::Random random(3);
  Dataset east, west;
  for (int s = 0; s < 2000; ++s) {
    const float distance = static_cast<float>(random.uniform());
    const float force = distance < 0.5f ? 1.0f - 2 * distance : 0.0f;
    east.add_input(0, {distance, 0, 0.3f, 0, 0, 0});
    east.add_sample(1, {force});
    west.add_input(0, {-distance, 0, 0.3f, 0, 0, 0});
    west.add_sample(1, {force});
  }
  const auto error_to_the_west = [&](bool turns) {
    TrainerOptions options = options_with(10, Scope::kLayer, Mode::kClip);
    options.turns = turns;
    Trainer trainer(layout, east, all_samples(east), initial_parameters(layout, 2), options);
    for (int epoch = 0; epoch < 60; ++epoch) trainer.run_epoch(epoch, 1e-2);
    return std::sqrt(mean_loss(layout, trainer.theta(), west, all_samples(west), 1));
  };
  EXPECT_LT(error_to_the_west(true), 0.05);
  EXPECT_GT(error_to_the_west(false), 0.2);
}

TEST(Trainer, LearnsTheForceOfAnotherDeepSet) {
  const Layout layout({{"phi:default", {6, 16, 8}, 0}, {"rho:default", {8, 16, 1}, 0}});
  const Vector truth = 2 * initial_parameters(layout, 1);
  files::Random random(5);
  Dataset data;
  for (int s = 0; s < 4000; ++s) {
    for (std::uint64_t j = 1 + random.below(2); j > 0; --j) data.add_input(0, random_values(6, random));
    data.add_sample(1, {0.0f});
  }
  const std::vector<Index> samples = all_samples(data);
  const Matrix force = predict(layout, truth, data, samples.data(), data.samples());
  for (Index s = 0; s < data.samples(); ++s) data.target[s] = force(0, s);
  const double variance = static_cast<double>((force.array() - force.mean()).square().mean());

  for (const Layers layers : kAllLayers) {
    TrainerOptions options = options_with(10, Scope::kLayer, Mode::kClip);
    options.layers = layers;
    Trainer trainer(layout, data, samples, initial_parameters(layout, 2), options);
    if (layers != Layers::kFree) trainer.tighten({0.2, 0.2});
    for (int epoch = 0; epoch < 60; ++epoch) trainer.run_epoch(epoch, 1e-2);
    EXPECT_LT(mean_loss(layout, trainer.theta(), data, samples, 1),
              (layers == Layers::kFree ? 0.05 : 0.1) * variance)
        << static_cast<int>(layers);
  }
}

}  // namespace
}  // namespace swarmcert::training
