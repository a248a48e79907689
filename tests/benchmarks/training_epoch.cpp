// Run time of an epoch over 10^6 samples with two neighbours each for the networks of the paper (phi 6-25-40-40-40, rho
// 40-40-40-40-1), compared with the same gradient computed sample by sample.
// Usage: benchmark_training_epoch [SAMPLES [JOBS]].
#include <fmt/core.h>

#include <chrono>
#include <cstdlib>
#include <functional>
#include <numeric>

#include "nn/training/trainer.h"

namespace {

using namespace swarmcert;
using Eigen::Index;

double seconds(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

training::Dataset random_dataset(Index samples) {
  files::Random random(1);
  training::Dataset data;
  const auto value = [&] { return static_cast<float>(random.symmetric()); };
  for (Index s = 0; s < samples; ++s) {
    for (int j = 0; j < 2; ++j) data.add_input(0, {value(), value(), value(), value(), value(), value()});
    data.add_sample(1, {value()});
  }
  return data;
}

}  // namespace

int main(int argc, char** argv) {
  const Index count = argc > 1 ? std::atol(argv[1]) : 1000000;
  training::TrainerOptions options;
  options.gamma.value = 3;
  options.jobs = argc > 2 ? std::atoi(argv[2]) : 0;
  const training::Layout layout(
      {{"phi:default", {6, 25, 40, 40, 40}, 0}, {"rho:default", {40, 40, 40, 40, 1}, 0}});
  const training::Dataset data = random_dataset(count);
  std::vector<Index> samples(static_cast<std::size_t>(count));
  std::iota(samples.begin(), samples.end(), Index{0});

  training::Trainer trainer(layout, data, samples, training::initial_parameters(layout, 1), options);
  const double epoch = seconds([&] { trainer.run_epoch(0, 1e-3); });

  const Index few = std::min<Index>(count, 20000);
  training::Vector gradient = training::Vector::Zero(layout.size());
  const double one_by_one =
      seconds([&] {
        for (Index s = 0; s < few; ++s)
          training::deep_set_loss(layout, trainer.theta(), data, &samples[s], 1, &gradient);
      }) *
      static_cast<double>(count) / static_cast<double>(few);

  fmt::print("{:<34} {:>10}\n", fmt::format("{} samples, 2 neighbours each", count), "seconds");
  fmt::print("{:<34} {:>10.2f}\n", "epoch, batches of 1024", epoch);
  fmt::print("{:<34} {:>10.2f}   one thread, extrapolated from {} samples\n", "gradient, sample by sample",
             one_by_one, few);
  fmt::print("{:<34} {:>10.1f}\n", "ratio", one_by_one / epoch);
}
