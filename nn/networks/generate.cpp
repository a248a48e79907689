// Generates the bundled networks: a deep set fitted to a synthetic downwash. Usage: swarmcert_generate_networks FOLDER
//
// The ground truth is a formula of our own, so that the project does not ship anyone's data: a neighbour at the height
// z > 0 above a vehicle pushes it down by
//   F = 9 gf * ramp(z) * 0.45 / (0.15 + z) / (1 + (r / s)^2)^2,
//   s = 0.06 m + 0.1 z,   ramp = clamp((z - 0.05) / 0.1, 0, 1),
// where r is the lateral distance to the wake, which is displaced by 0.15 s times the relative velocity. The forces of
// several neighbours add like momentum fluxes, f = -sqrt(sum F^2). The magnitude is about that between two Crazyflies;
// otherwise the model is a caricature. The fit is deliberately small; only the certified bounds are claimed for it.
//
// The bits are the same everywhere: own random numbers, loops in a fixed order without fused operations, and no library
// function but sqrt.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>
#include <vector>

#include "nn/base/random.h"
#include "nn/weights/weights.h"

namespace {

using swarmcert::files::Layer;
using swarmcert::files::Precision;
using swarmcert::files::Random;
using swarmcert::files::Weights;

constexpr double kGamma = 3.0;  ///< limit on every layer's spectral norm
/// Margin of the stored weights below gamma: rounding to float32 changes a norm by less than 40 * 2^-24 of its value.
constexpr double kHeadroom = 1 - 4e-6;
constexpr int kSteps = 4000;
constexpr int kBatch = 48;

/// A neighbour's relative position in m, then its relative velocity in m/s.
using Input = std::array<double, 6>;

struct Sample {
  std::vector<Input> neighbours;
  double force_gf = 0;
};

Sample draw(Random& random) {
  Sample sample;
  double squares = 0;
  for (int j = 1 + static_cast<int>(random.below(3)); j > 0; --j) {
    Input x{};
    const double spread = random.below(2) == 0 ? 0.15 : 0.5;  // half of the neighbours near the wake
    x[0] = spread * random.symmetric();
    x[1] = spread * random.symmetric();
    x[2] = 0.8 * random.symmetric();
    for (int k = 3; k < 6; ++k) x[k] = random.symmetric();
    sample.neighbours.push_back(x);
    const double z = x[2];
    const double ramp = std::clamp((z - 0.05) / 0.1, 0.0, 1.0);
    if (ramp <= 0) continue;
    const double side_x = x[0] - 0.15 * z * x[3];
    const double side_y = x[1] - 0.15 * z * x[4];
    const double width = 0.06 + 0.1 * z;
    const double falloff = 1 + (side_x * side_x + side_y * side_y) / (width * width);
    const double force = 9 * ramp * 0.45 / (0.15 + z) / (falloff * falloff);
    squares += force * force;
  }
  sample.force_gf = -std::sqrt(squares);
  return sample;
}

/// A layer with the state of Adam (Kingma and Ba 2015) and of the power iteration.
struct Trained {
  Layer layer;
  std::vector<double> gradient, first_moment, second_moment;  ///< weights, then biases
  std::vector<double> right;  ///< estimate of the leading right singular vector

  Trained(int inputs, int outputs, Random& random) {
    layer.inputs = inputs;
    layer.outputs = outputs;
    const double bound = std::sqrt(3.0 / inputs);
    for (int i = 0; i < inputs * outputs; ++i) layer.weights.push_back(bound * random.symmetric());
    for (int i = 0; i < outputs; ++i) layer.biases.push_back(0.1 * random.symmetric());
    const std::size_t size = layer.weights.size() + layer.biases.size();
    gradient.assign(size, 0);
    first_moment.assign(size, 0);
    second_moment.assign(size, 0);
    for (int i = 0; i < inputs; ++i) right.push_back(random.symmetric());
  }
};

/// Power iteration on W'W with a warm start; converges to the spectral norm from below.
double spectral_norm(Trained& trained, int iterations) {
  const Layer& layer = trained.layer;
  double norm = 0;
  for (int iteration = 0; iteration < iterations; ++iteration) {
    std::vector<double> next(trained.right.size(), 0.0);
    double image = 0;
    double length = 0;
    for (int i = 0; i < layer.outputs; ++i) {
      const double* row = &layer.weights[static_cast<std::size_t>(i) * layer.inputs];
      double sum = 0;
      for (int j = 0; j < layer.inputs; ++j) sum += row[j] * trained.right[j];
      image += sum * sum;
      for (int j = 0; j < layer.inputs; ++j) next[j] += row[j] * sum;
    }
    for (const double x : trained.right) length += x * x;
    norm = std::sqrt(image / length);
    double next_length = 0;
    for (const double x : next) next_length += x * x;
    if (!(next_length > 0)) return 0;
    for (double& x : next) x /= std::sqrt(next_length);
    trained.right = std::move(next);
  }
  return norm;
}

void clip(Trained& trained, double limit, int iterations) {
  const double norm = spectral_norm(trained, iterations);
  if (norm <= limit) return;
  for (double& weight : trained.layer.weights) weight *= limit / norm;
}

using Net = std::vector<Trained>;
using Activations = std::vector<std::vector<double>>;  ///< input, then each layer's output after its ReLU

Activations forward(const Net& net, std::vector<double> x) {
  Activations all = {std::move(x)};
  for (std::size_t k = 0; k < net.size(); ++k) {
    const Layer& layer = net[k].layer;
    std::vector<double> y = layer.biases;
    for (int i = 0; i < layer.outputs; ++i) {
      const double* row = &layer.weights[static_cast<std::size_t>(i) * layer.inputs];
      for (int j = 0; j < layer.inputs; ++j) y[i] += row[j] * all.back()[j];
      if (k + 1 < net.size() && y[i] < 0) y[i] = 0;
    }
    all.push_back(std::move(y));
  }
  return all;
}

/// Adds the gradient of the loss to `net`, given the gradient with respect to its output; returns the gradient with
/// respect to its input.
std::vector<double> backward(Net& net, const Activations& all, std::vector<double> error) {
  for (std::size_t k = net.size(); k-- > 0;) {
    const Layer& layer = net[k].layer;
    std::vector<double> before(static_cast<std::size_t>(layer.inputs), 0.0);
    for (int i = 0; i < layer.outputs; ++i) {
      if (k + 1 < net.size() && all[k + 1][i] <= 0) continue;
      double* gradient = &net[k].gradient[static_cast<std::size_t>(i) * layer.inputs];
      const double* row = &layer.weights[static_cast<std::size_t>(i) * layer.inputs];
      for (int j = 0; j < layer.inputs; ++j) gradient[j] += error[i] * all[k][j];
      for (int j = 0; j < layer.inputs; ++j) before[j] += error[i] * row[j];
      net[k].gradient[layer.weights.size() + static_cast<std::size_t>(i)] += error[i];
    }
    error = std::move(before);
  }
  return error;
}

class DeepSet {
 public:
  explicit DeepSet(Random& random) {
    for (const auto& [inputs, outputs] : {std::pair(6, 25), {25, 40}, {40, 40}, {40, 20}}) {
      phi_.emplace_back(inputs, outputs, random);
    }
    for (const auto& [inputs, outputs] : {std::pair(20, 40), {40, 40}, {40, 40}, {40, 1}}) {
      rho_.emplace_back(inputs, outputs, random);
    }
  }

  double predict(const Sample& sample) const {
    std::vector<double> sum(20, 0.0);
    for (const Input& x : sample.neighbours) {
      const Activations all = forward(phi_, {x.begin(), x.end()});
      for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += all.back()[i];
    }
    return forward(rho_, sum).back()[0];
  }

  /// Performs one step of Adam on the mean squared error, then clips every layer.
  void step(const std::vector<Sample>& batch, double rate) {
    for (const Sample& sample : batch) add_gradient(sample, 2.0 / static_cast<double>(batch.size()));
    decay1_ *= 0.9;
    decay2_ *= 0.999;
    for (Net* net : {&phi_, &rho_}) {
      for (Trained& trained : *net) {
        update(trained, rate);
        clip(trained, kGamma, 1);
      }
    }
  }

  /// Prepares the network for storage: projects it again, so accurately that rounding to float32 cannot exceed gamma.
  void finish() {
    for (Net* net : {&phi_, &rho_}) {
      for (Trained& trained : *net) {
        clip(trained, kGamma * kHeadroom, 2000);
        for (double& x : trained.layer.weights) x = static_cast<double>(static_cast<float>(x));
        for (double& x : trained.layer.biases) x = static_cast<double>(static_cast<float>(x));
      }
    }
  }

  void save(const std::filesystem::path& folder) const {
    for (const auto& [net, name] : {std::pair(&phi_, "phi"), std::pair(&rho_, "rho")}) {
      Weights weights;
      weights.precision = Precision::kFloat32;
      for (const Trained& trained : *net) {
        weights.layers.push_back(trained.layer);
        weights.layers.back().name = "fc" + std::to_string(weights.layers.size());
      }
      save_safetensors(weights, (folder / (std::string(name) + ".safetensors")).string(), true);
    }
  }

 private:
  void add_gradient(const Sample& sample, double weight) {
    std::vector<Activations> each;
    std::vector<double> sum(20, 0.0);
    for (const Input& x : sample.neighbours) {
      each.push_back(forward(phi_, {x.begin(), x.end()}));
      for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += each.back().back()[i];
    }
    const Activations top = forward(rho_, sum);
    const std::vector<double> error = backward(rho_, top, {weight * (top.back()[0] - sample.force_gf)});
    for (const Activations& all : each) backward(phi_, all, error);
  }

  void update(Trained& trained, double rate) const {
    const std::size_t weights = trained.layer.weights.size();
    for (std::size_t i = 0; i < trained.gradient.size(); ++i) {
      const double g = trained.gradient[i];
      double& m = trained.first_moment[i];
      double& v = trained.second_moment[i];
      m = 0.9 * m + 0.1 * g;
      v = 0.999 * v + 0.001 * g * g;
      const double change = rate * (m / (1 - decay1_)) / (std::sqrt(v / (1 - decay2_)) + 1e-8);
      (i < weights ? trained.layer.weights[i] : trained.layer.biases[i - weights]) -= change;
      trained.gradient[i] = 0;
    }
  }

  Net phi_, rho_;
  double decay1_ = 1, decay2_ = 1;
};

double rms_error(const DeepSet& net, std::uint64_t seed) {
  Random random(seed);
  double squares = 0;
  constexpr int kCount = 4000;
  for (int i = 0; i < kCount; ++i) {
    const Sample sample = draw(random);
    const double error = net.predict(sample) - sample.force_gf;
    squares += error * error;
  }
  return std::sqrt(squares / kCount);
}

double rms_force(std::uint64_t seed) {
  Random random(seed);
  double squares = 0;
  constexpr int kCount = 4000;
  for (int i = 0; i < kCount; ++i) {
    const double force = draw(random).force_gf;
    squares += force * force;
  }
  return std::sqrt(squares / kCount);
}

void generate(const std::filesystem::path& folder) {
  Random random(20190917);
  DeepSet net(random);
  for (int step = 0; step < kSteps; ++step) {
    std::vector<Sample> batch;
    for (int i = 0; i < kBatch; ++i) batch.push_back(draw(random));
    net.step(batch, step < kSteps / 2 ? 2e-3 : step < 7 * kSteps / 8 ? 5e-4 : 1e-4);
    if (step % 500 == 0) std::fprintf(stderr, "step %d of %d\n", step, kSteps);
  }
  net.finish();
  std::filesystem::create_directories(folder);
  net.save(folder);
  std::printf("rms force %.3f gf, rms error of the fit on held-out samples %.3f gf\n", rms_force(7),
              rms_error(net, 7));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: %s FOLDER\n", argv[0]);
    return 2;
  }
  try {
    generate(argv[1]);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
