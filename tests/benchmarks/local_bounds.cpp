// Compares bounds on a box: branch and bound with its verified proof, the bound for all inputs, and the norm of the
// interval Jacobian over the whole box. Usage: benchmark_local_bounds [SECONDS [default-slopes]]; SECONDS per function
// (default 60), default-slopes as --default-slopes of certify. Uses the recorded networks if they are present, else the
// bundled one. Runs on one thread. "per box": average number of undecided neurons per box. "witness": a slope attained
// in the box. "1.01 at": estimated number of boxes for that ratio, if the gap continues to decrease as in the second
// half of the search.
//
// Effect of better slopes: boxes and processor seconds of search and check until the same bound is reached, with and
// without better slopes, on a busy machine:
//   phi_G 14.873    9689 and 10593 boxes, 2.7 + 1.0 and 2.9 + 1.4 s
//   phi_L 22.705   25003 and 28127 boxes, 12.5 + 4.7 and 13.2 + 6.2 s (the lesser of two runs)
//   set L 388      16713 and 18897 boxes, 10.9 + 3.1 and 10.8 + 3.6 s (the least of three)
//   set L, 1 366   11425 and 14717 boxes, 27.3 + 7.7 and 28.9 + 12.3 s
// The number of undecided neurons per box changes by less than two percent, because some boxes need no further halving.
#include <fmt/core.h>

#include <Eigen/SVD>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>

#include "data.h"
#include "lipschitz/branch/local_bound.h"
#include "lipschitz/checker/stages.h"
#include "lipschitz/lower/lower_bound.h"
#include "lipschitz/upper/sdp_bound.h"
#include "nn/weights/functions.h"

namespace {

using namespace swarmcert;
using Eigen::MatrixXd;

double since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Returns |mid J| + |rad J| for J = W_K D_K-1 ... D_1 W_1 with the entries of D in {0}, {1} or [0, 1] as decided by
/// the box: the initial relaxation of branch and bound without a semidefinite program.
double interval_jacobian(const files::Weights& weights, const lipschitz::Box& box) {
  const lipschitz::ReachNetwork network = lipschitz::reach_network(weights);
  const lipschitz::Reach reach(network, box);
  MatrixXd middle = network.front().weights, radius = MatrixXd::Zero(middle.rows(), middle.cols());
  for (std::size_t k = 0; k + 1 < network.size(); ++k) {
    const lipschitz::Bounds& bounds = reach.before_relu(k);
    for (Eigen::Index i = 0; i < middle.rows(); ++i) {
      if (bounds.lower(i) >= 0) continue;
      if (bounds.upper(i) <= 0) {
        middle.row(i).setZero();
        radius.row(i).setZero();
        continue;
      }
      const Eigen::RowVectorXd low = (middle.row(i) - radius.row(i)).cwiseMin(0.0);
      const Eigen::RowVectorXd high = (middle.row(i) + radius.row(i)).cwiseMax(0.0);
      middle.row(i) = (low + high) / 2;
      radius.row(i) = (high - low) / 2;
    }
    const MatrixXd& w = network[k + 1].weights;
    radius = w.cwiseAbs() * radius;
    middle = w * middle;
  }
  return middle.jacobiSvd().singularValues()(0) + radius.jacobiSvd().singularValues()(0);
}

/// Returns the number of boxes for a ratio of 1.01 if the gap follows the power law of the second half of the search.
std::string boxes_for_one_percent(const lipschitz::LocalBound& bound, double witness) {
  const double gap = bound.upper.value() / witness - 1, before = bound.outlook.bound_halfway / witness - 1;
  if (gap <= 0.01) return "reached";
  if (!(before > gap)) return "never";
  return fmt::format("{:.1e}", bound.nodes * std::pow(gap / 0.01, 1 / std::log2(before / gap)));
}

void run(const std::string& name, const files::Network& network, const files::FunctionId& function,
         const lipschitz::BranchOptions& given, const lipschitz::Neighbours& neighbours = {}) {
  const files::Parts parts = files::parts(network);
  const std::string part = function == "network" ? "network" : "phi:default";
  const files::Weights& weights = *parts.at(part);
  lipschitz::Box box;
  const std::size_t positions = weights.inputs() == 4 ? 1 : 3;  // the ground has height and velocity
  for (std::size_t k = 0; k < static_cast<std::size_t>(weights.inputs()); ++k) {
    box.upper.push_back(k < positions ? 1 : 2);
    box.lower.push_back(-box.upper.back());
  }
  lipschitz::Claim claim;
  claim.function = function;
  claim.domain = "box";
  claim.neighbours = neighbours;
  const std::map<std::string, lipschitz::Box> domain = {{part, box}};
  lipschitz::LowerBoundOptions lower;
  double witness = 0;
  const auto look_for_slopes = [&] {
    const lipschitz::FoundSlope found = lipschitz::lower_bound(network, claim, domain, lower);
    if (found.witness) witness = std::max(witness, found.witness->slope.value());
  };
  look_for_slopes();
  const lipschitz::SdpBound global = lipschitz::sdp_bound(check::stages(network, function));

  lipschitz::BranchOptions options = given;
  options.known = witness;
  const auto start = std::chrono::steady_clock::now();
  const lipschitz::LocalBound bound =
      lipschitz::local_bound(network, claim, domain, global.proof->t, options);
  const double total = since(start);
  lower.starts = bound.steep_centres;
  look_for_slopes();
  const double jacobian = function == "network" ? interval_jacobian(weights, box) : 0;
  fmt::print("{:<12} {:>9.4f} {:>9.4f} {:>8.4f} {:>9.4f} {:>7.3f} {:>9.1f} {:>8.1f} {:>8} {:>8.1f} {:>8}\n",
             name, bound.upper.value(), witness, witness > 0 ? bound.upper.value() / witness : 0,
             global.proof->upper.value(), global.proof->upper.value() / bound.upper.value(), jacobian, total,
             bound.nodes, bound.undecided_per_box, boxes_for_one_percent(bound, witness));
}

}  // namespace

int main(int argc, char** argv) {
  lipschitz::BranchOptions options;
  options.nodes = 1'000'000;
  options.seconds = argc > 1 ? std::atof(argv[1]) : 60;
  options.better_slopes = argc < 3 || std::string(argv[2]) != "default-slopes";
  fmt::print("{:<12} {:>9} {:>9} {:>8} {:>9} {:>7} {:>9} {:>8} {:>8} {:>8} {:>8}\n", "function", "branch",
             "witness", "ratio", "all x", "gain", "interval", "s+check", "boxes", "per box", "1.01 at");
  const auto weights = [](const std::string& name) {
    return files::load_weights(tests::data_path("weights/zip_f32/" + name));
  };
  if (!tests::data_is_present()) {
    files::NetworkArguments demo;
    demo.phi = tests::source_path("nn/networks/demo/phi.safetensors");
    demo.rho = tests::source_path("nn/networks/demo/rho.safetensors");
    run("demo set", files::load_network(demo), "set:default:default", options);
    return 0;
  }
  for (const char* const name : {"phi_G", "phi_L", "phi_S"}) {
    files::Network network;
    network.plain = weights(std::string(name) + ".pth");
    run(name, network, "network", options);
  }
  for (const char* const kind : {"L", "S"}) {
    files::Network network;
    network.phi["default"] = weights(std::string("phi_") + kind + ".pth");
    network.rho["default"] = weights(std::string("rho_") + kind + ".pth");
    run(std::string("set ") + kind, network, "set:default:default", options);
    run(std::string("set ") + kind + ", 1", network, "set:default:default", options, {{"default", 1}});
  }
}
