// Compares proved ranges, jumps and float32 errors over a box with values found by search, on the recorded networks, if
// present, and on random ones. Usage: benchmark_value_bounds [STARTS [NAME [ranges|float32 [NODES]]]]: local searches
// for each float32 error (default 40), part of the names of the networks to use, the quantity to compute,
// and parts of the box per search (default as the library). The last number of a line is a ratio: (upper - lower) over
// (greatest - least) for a range, jump over the largest step found, error over the largest error found. One thread,
// processor seconds. "normal": every layer has a spectral norm of 2.
//
// Float32 errors with round-off bounded relative to the magnitude, over 8000 parts, and with half the distance between
// floats, over 16000 parts; compared with the same 24 local searches:
//   phi_G 4.34e-5 and 2.91e-5 (12.0 and 8.0 times what is found), phi_L 3.64e-5 and 2.17e-5 (50 and 30),
//   phi_S 1.07e-4 and 6.47e-5 (83 and 50)
#include <fmt/core.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <random>

#include "data.h"
#include "lipschitz/certify.h"
#include "lipschitz/float32_search.h"
#include "lipschitz/values/float32_error.h"
#include "lipschitz/values/range.h"
#include "nn/base/random.h"
#include "nn/random_network.h"
#include "nn/weights/functions.h"

namespace {

using namespace swarmcert;

/// Processor seconds.
double since(std::clock_t start) { return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC; }

lipschitz::Domain domain_of(const files::Network& network) {
  lipschitz::Domain domain;
  for (const auto& [part, weights] : files::parts(network)) {
    if (part.is_rho()) continue;
    lipschitz::Box& box = domain[part];
    const int positions = weights->inputs() == 4 ? 1 : 3;  // the ground sees its height and its velocity
    for (int k = 0; k < weights->inputs(); ++k) {
      box.upper.push_back(k < positions ? 1 : 2);
      box.lower.push_back(-box.upper.back());
    }
  }
  return domain;
}

/// Returns the largest step of a set function, found by local search, when the last of up to `neighbours` appears.
double step_found(const files::Network& network, const lipschitz::Box& box, int neighbours) {
  const files::Evaluator<double> phi(network.phi.at("default")), rho(network.rho.at("default"));
  files::Random random(3);
  const auto step = [&](const std::vector<std::vector<double>>& x) {
    std::vector<double> sum(static_cast<std::size_t>(rho.mlp().inputs()));
    double before = 0, after = 0;
    for (std::size_t j = 0; j < x.size(); ++j) {
      before = rho(sum)[0];
      const std::vector<double> term = phi(x[j]);
      for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += term[i];
      after = rho(sum)[0];
    }
    return std::abs(after - before);
  };
  double largest = 0;
  for (int start = 0; start < 12; ++start) {
    std::vector<std::vector<double>> best(1 + random.below(static_cast<std::uint64_t>(neighbours)));
    for (auto& x : best)
      for (std::size_t k = 0; k < box.lower.size(); ++k)
        x.push_back(std::clamp(2 * random.symmetric(), -1.0, 1.0) * box.upper[k]);
    double found = step(best);
    for (int i = 0; i < 3000; ++i) {
      auto x = best;
      for (auto& one : x)
        for (std::size_t k = 0; k < one.size(); ++k)
          if (random.below(2) == 0)
            one[k] = std::clamp(one[k] + std::exp2(-14.0 * i / 3000) * box.upper[k] * random.symmetric(),
                                box.lower[k], box.upper[k]);
      if (const double value = step(x); value > found) found = value, best = std::move(x);
    }
    largest = std::max(largest, found);
  }
  return largest;
}

void run(const std::string& name, const files::Network& network, int neighbours, int starts,
         const std::string& what, int nodes) {
  const lipschitz::Domain domain = domain_of(network);
  std::map<files::FunctionId, double> bounds;
  std::map<std::string, double> rho;
  lipschitz::CertifyOptions certify;
  certify.lower.rounds = 0;
  for (const lipschitz::CertifiedBound& bound : lipschitz::certify(network, certify).bounds) {
    bounds[bound.function] = bound.upper.value();
    if (bound.function.is_rho()) rho[bound.function.kind()] = bound.upper.value();
  }
  lipschitz::RangeOptions range;
  range.neighbours = neighbours;
  range.jobs = 1;
  range.nodes = nodes;
  auto start = std::clock();
  if (what != "float32")
    for (const lipschitz::CertifiedRange& found : lipschitz::ranges(network, domain, rho, range)) {
      fmt::print("{:<22} range {} {:>10.4f} {:>10.4f} {:>10.4f} {:>10.4f} {:>8.3f}", name,
                 found.neighbours_at_most, found.lower, found.least.value, found.greatest.value, found.upper,
                 (found.upper - found.lower) / (found.greatest.value - found.least.value));
      if (found.neighbours_at_most > 0) {
        const double step = step_found(network, domain.at("phi:default"), found.neighbours_at_most);
        fmt::print("  jump {:>9.4f} {:>9.4f} {:>7.3f}", found.jump, step, found.jump / step);
      }
      fmt::print("\n");
    }
  fmt::print("{:<22} ranges took {:.1f} s\n", name, since(start));
  std::fflush(stdout);
  if (what == "ranges") return;
  const auto parts = files::parts(network);
  if (std::any_of(parts.begin(), parts.end(),
                  [](const auto& part) { return part.second->precision != files::Precision::kFloat32; }))
    return;
  lipschitz::Float32Options float32;
  float32.neighbours = neighbours;
  float32.jobs = 1;
  float32.nodes = nodes;
  start = std::clock();
  const auto errors = lipschitz::float32_errors(network, domain, bounds, float32);
  const double took = since(start);
  for (const lipschitz::Float32Error& error : errors) {
    start = std::clock();
    const double found = lipschitz::float32_error_found(network, domain, error.function,
                                                        std::max(1, error.neighbours_at_most), {starts, 1})
                             .value;
    fmt::print("{:<22} float32 {} {:>12.4g} {:>12.4g} {:>8.2f}  {:.1f} s, search {:.1f} s\n", name,
               error.neighbours_at_most, error.evaluation.value(), found, error.evaluation.value() / found,
               took, since(start));
    std::fflush(stdout);
  }
}

/// Scales every layer to at most this norm, as training with spectral normalisation does.
void normalise(files::Weights& weights, double norm) {
  for (files::Layer& layer : weights.layers) {
    const Eigen::Map<const Eigen::MatrixXd> map(layer.weights.data(), layer.inputs, layer.outputs);
    const double factor = norm / map.jacobiSvd().singularValues()(0);
    for (double& weight : layer.weights) weight = static_cast<double>(static_cast<float>(weight * factor));
  }
}

}  // namespace

int main(int argc, char** argv) {
  const int starts = argc > 1 ? std::atoi(argv[1]) : 40;
  const std::string only = argc > 2 ? argv[2] : "", what = argc > 3 ? argv[3] : "";
  const int nodes = argc > 4 ? std::atoi(argv[4]) : 0;
  const auto run_one = [&](const std::string& name, const files::Network& network, int neighbours) {
    if (name.find(only) != std::string::npos) run(name, network, neighbours, starts, what, nodes);
  };
  if (tests::data_is_present()) {
    const auto weights = [](const std::string& name) {
      return files::load_weights(tests::data_path("weights/" + name));
    };
    for (const char* const name : {"phi_G", "phi_L", "phi_S"}) {
      files::Network network;
      network.plain = weights(std::string("zip_f32/") + name + ".pth");
      run_one(name, network, 1);
    }
    for (const char* const folder : {"zip_f32/", "legacy_f64/"})
      for (const char* const kind : {"L", "S"}) {
        files::Network network;
        network.phi["default"] = weights(std::string(folder) + "phi_" + kind + ".pth");
        network.rho["default"] = weights(std::string(folder) + "rho_" + kind + ".pth");
        run_one(std::string("set ") + kind + (folder[0] == 'l' ? ", legacy" : ""), network, 2);
      }
  }
  std::mt19937 generator(1);
  for (const std::vector<int>& sizes : std::vector<std::vector<int>>{
           {4, 20, 20, 1}, {6, 25, 40, 40, 20}, {6, 40, 40, 40, 40, 1}, {6, 64, 64, 1}})
    for (const bool is_normal : {true, false}) {
      files::Network network;
      network.plain = tests::random_network(sizes, generator);
      if (is_normal) normalise(*network.plain, 2);
      std::string name = is_normal ? "normal" : "random";
      for (const int size : sizes) name += "-" + std::to_string(size);
      run_one(name, network, 1);
    }
  for (const bool is_normal : {true, false}) {
    files::Network network;
    network.phi["default"] = tests::random_network({6, 25, 40, 40, 20}, generator);
    network.rho["default"] = tests::random_network({20, 40, 40, 40, 1}, generator);
    if (is_normal) normalise(network.phi["default"], 2), normalise(network.rho["default"], 2);
    run_one(is_normal ? "normal set" : "random set", network, 2);
  }
}
