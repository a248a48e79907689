// Compares upper bounds: our interior-point method with its exact proof, csdp on the same program, and the product of
// spectral norms. Usage: benchmark_upper_bounds [--phi F --rho F]; without arguments the recorded networks L and S if
// they are present, else the bundled one. Processes run on one thread.
#include <fmt/core.h>
#include <unistd.h>

#include <Eigen/SVD>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>

#include "benchmarks/sdpa_export.h"
#include "data.h"
#include "lipschitz/checker/check.h"
#include "lipschitz/checker/lipschitz_lmi.h"
#include "lipschitz/checker/stages.h"
#include "lipschitz/upper/sdp_bound.h"
#include "lipschitz/upper/spectral_norm.h"
#include "nn/weights/functions.h"

namespace {

using namespace swarmcert;

/// Returns the median time of five calls after a warm-up call.
double seconds(const std::function<void()>& work) {
  std::vector<double> times;
  for (int i = 0; i < 6; ++i) {
    const auto start = std::chrono::steady_clock::now();
    work();
    if (i > 0)
      times.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  std::sort(times.begin(), times.end());
  return times[times.size() / 2];
}

/// Returns the chain in the scaling that suits csdp best: every layer has spectral norm one. Sets `factor` to the
/// product of the divisors.
lipschitz::ReluChain normalised(const std::vector<check::Matrix>& stages, double& factor) {
  lipschitz::ReluChain chain;
  factor = 1;
  for (const check::Matrix& stage : stages) {
    Eigen::MatrixXd m(stage.rows, stage.cols);
    for (int i = 0; i < stage.rows; ++i) {
      for (int j = 0; j < stage.cols; ++j) m(i, j) = lipschitz::to_double(stage(i, j));
    }
    const double norm = m.jacobiSvd().singularValues()(0);
    factor *= norm;
    chain.push_back(m / norm);
  }
  return chain;
}

struct Csdp {
  double bound = 0;
  double time = 0;
};

Csdp run_csdp(const std::vector<check::Matrix>& stages) {
  if (std::system("command -v csdp >/dev/null 2>&1") != 0) return {};
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / fmt::format("swarmcert-csdp-{}", ::getpid());
  std::filesystem::create_directories(folder);
  double factor = 1;
  const lipschitz::ReluChain chain = normalised(stages, factor);
  std::ofstream(folder / "lipsdp.dat-s") << [&] {
    std::ostringstream text;
    benchmarks::write_sdpa(chain, text);
    return text.str();
  }();
  const std::string command =
      fmt::format("cd {} && OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 csdp lipsdp.dat-s solution > log 2>&1",
                  folder.string());
  Csdp result;
  result.time = seconds([&] {
    if (std::system(command.c_str()) < 0) std::exit(1);
  });
  std::ifstream log(folder / "log");
  for (std::string line; std::getline(log, line);) {
    const std::string key = "Primal objective value: ";
    if (line.rfind(key, 0) == 0)
      result.bound = std::sqrt(std::abs(std::stod(line.substr(key.size())))) * factor;
  }
  std::filesystem::remove_all(folder);
  return result;
}

void compare(const files::Network& network, const std::string& title) {
  fmt::print("\n{}\n{:<22} {:>14} {:>9} {:>9} {:>14} {:>9} {:>11} {:>8} {:>7}\n", title, "function", "proved",
             "solve s", "check s", "csdp", "csdp s", "product", "csdp/us", "prod/us");
  for (const files::FunctionId& function : files::functions(network)) {
    const std::vector<check::Matrix> stages = check::stages(network, function);
    lipschitz::SdpBound bound;
    const double solve = seconds([&] { bound = lipschitz::sdp_bound(stages); });
    if (!bound.proof) {
      fmt::print("{:<22} no proof: {}\n", function, name(bound.stop));
      continue;
    }
    const double check_time = seconds([&] {
      const check::SymmetricMatrix lmi = check::lipschitz_lmi(
          check::stages(network, function), bound.proof->rho, {bound.proof->t.begin(), bound.proof->t.end()});
      if (!check::shows_positive_semidefinite(lmi, bound.proof->factor)) std::exit(1);
    });
    std::vector<lipschitz::UpperBound> norms;
    for (const std::string& name : function.parts()) {
      for (const files::Layer& layer : files::parts(network).at(name)->layers) {
        norms.push_back(lipschitz::spectral_norm(layer).norm.upper);
      }
    }
    const double product = lipschitz::product_up(norms).value();
    const Csdp csdp = run_csdp(stages);
    const double upper = bound.proof->upper.value();
    fmt::print("{:<22} {:>14.9g} {:>9.4f} {:>9.4f} {:>14.9g} {:>9.3f} {:>11.6g} {:>8.1f} {:>7.2f}\n",
               function, upper, solve, check_time, csdp.bound, csdp.time, product, csdp.time / solve,
               product / upper);
  }
}

}  // namespace

int main(int argc, char** argv) {
  fmt::print(
      "median wall seconds of 5 runs; solve includes the exact proof; csdp/us: csdp's time over ours;\n"
      "prod/us: product bound over proved bound. csdp's value is not a bound; it is 0 if csdp is not "
      "installed.\n");
  files::NetworkArguments arguments;
  if (argc == 5) {
    arguments.phi = argv[2];
    arguments.rho = argv[4];
    compare(files::load_network(arguments), arguments.phi + ", " + arguments.rho);
  } else if (tests::data_is_present()) {
    for (const std::string kind : {"L", "S"}) {
      arguments.phi = tests::data_path("weights/zip_f32/phi_" + kind + ".pth");
      arguments.rho = tests::data_path("weights/zip_f32/rho_" + kind + ".pth");
      compare(files::load_network(arguments), "recorded networks " + kind);
    }
  } else {
    arguments.file = tests::source_path("nn/networks/demo/network.toml");
    compare(files::load_network(arguments), "bundled network");
  }
  return 0;
}
