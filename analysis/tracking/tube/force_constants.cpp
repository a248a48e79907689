#include "analysis/tracking/tube/force_constants.h"

#include <algorithm>
#include <limits>

#include "lipschitz/branch/local_bound.h"
#include "lipschitz/checker/stages.h"
#include "lipschitz/upper/sdp_bound.h"
#include "lipschitz/upper/spectral_norm.h"
#include "nn/base/parallel.h"
#include "nn/weights/functions.h"

namespace swarmcert::analysis {

namespace {

constexpr double kNoConstant = std::numeric_limits<double>::infinity();

double product_bound(const files::Network& network, const files::FunctionId& function) {
  std::vector<lipschitz::UpperBound> norms;
  const auto parts = files::parts(network);
  for (const files::FunctionId& part : function.parts()) {
    for (const files::Layer& layer : parts.at(part)->layers)
      norms.push_back(lipschitz::spectral_norm(layer).norm.upper);
  }
  return lipschitz::product_up(norms).value();
}

bool has_block(const files::Network& network, const files::FunctionId& function, const std::string& block) {
  const std::vector<std::string> blocks = files::blocks(network, function);
  return std::find(blocks.begin(), blocks.end(), block) != blocks.end();
}

/// The LipSDP bound, at most `otherwise`; infinite for a block that the function does not have.
double sdp_constant(const files::Network& network, const files::FunctionId& function,
                    const std::string& block, double otherwise, std::vector<double>* t,
                    const std::atomic<bool>* cancelled) {
  if (block != "all" && !has_block(network, function, block)) return kNoConstant;
  const lipschitz::SdpBound found =
      lipschitz::sdp_bound(check::stages(network, function, block), {lipschitz::Stop(cancelled), {}});
  if (!found.proof) return otherwise;
  if (t != nullptr) *t = found.proof->t;
  return std::min(otherwise, found.proof->upper.value());
}

}  // namespace

GlobalConstants global_constants(const files::Network& network, const LearnedForce& learned,
                                 const std::atomic<bool>* cancelled) {
  GlobalConstants result;
  const double unit = learned.newton_per_unit();
  const files::FunctionId& function = learned.neighbour_function();
  const double product = product_bound(network, function);
  result.product.together = up(unit * product);
  result.product.position = result.product.velocity = kNoConstant;
  result.sdp.together = result.product.together;
  result.sdp.position =
      up(unit * sdp_constant(network, function, "position", product, &result.position_t, cancelled));
  result.sdp.velocity =
      up(unit * sdp_constant(network, function, "velocity", product, &result.velocity_t, cancelled));
  if (!learned.ground_function()) return result;
  const double own = product_bound(network, *learned.ground_function());
  result.product.own = up(unit * own);
  result.sdp.own =
      up(unit * sdp_constant(network, *learned.ground_function(), "all", own, nullptr, cancelled));
  return result;
}

std::vector<ForceConstants> local_constants(const files::Network& network, const Scene& scene,
                                            const Radii& radii, const GlobalConstants& global, int nodes,
                                            int jobs, const std::atomic<bool>* cancelled,
                                            const std::function<void(int done, int total)>& progress) {
  const LearnedForce& learned = scene.learned();
  const std::vector<int>& components = learned.input_components();
  std::vector<ForceConstants> result(static_cast<std::size_t>(scene.vehicles()), global.sdp);
  std::vector<lipschitz::Box> boxes(result.size());
  for (lipschitz::Box& box : boxes) {
    box.lower.assign(components.size(), kNoConstant);
    box.upper.assign(components.size(), -kNoConstant);
  }
  for (const Stretch& stretch : scene.motion().stretches) {
    const std::vector<Interval> states = scene.seen_states(stretch, all_within(radii));
    lipschitz::Box& box = boxes[static_cast<std::size_t>(stretch.vehicle)];
    for (int n = 0; n + 1 < scene.vehicles(); ++n) {
      for (std::size_t k = 0; k < components.size(); ++k) {
        const Interval& x = states[static_cast<std::size_t>(n * kPerNeighbour + components[k])];
        box.lower[k] = std::min(box.lower[k], x.lower);
        box.upper[k] = std::max(box.upper[k], x.upper);
      }
    }
  }
  for (lipschitz::Box& box : boxes) {
    for (std::size_t k = 0; network.clamp && k < components.size(); ++k) {
      box.lower[k] = std::clamp(box.lower[k], network.clamp->lower[k], network.clamp->upper[k]);
      box.upper[k] = std::clamp(box.upper[k], network.clamp->lower[k], network.clamp->upper[k]);
    }
  }
  std::atomic<int> done{0};
  const int total = 2 * scene.vehicles();
  files::parallel_for(total, jobs, [&](int task) {
    const auto i = static_cast<std::size_t>(task / 2);
    const bool is_position = task % 2 == 0;
    double& constant = is_position ? result[i].position : result[i].velocity;
    const std::vector<double>& t = is_position ? global.position_t : global.velocity_t;
    if (!t.empty() && (cancelled == nullptr || !*cancelled)) {
      lipschitz::BranchOptions branch;
      branch.nodes = nodes;
      branch.cancelled = cancelled;
      const lipschitz::Claim claim{
          learned.neighbour_function(), is_position ? "position" : "velocity", {}, "box"};
      const lipschitz::LocalBound found = local_bound(network, claim, boxes[i], t, branch);
      if (found.proof) constant = std::min(constant, up(learned.newton_per_unit() * found.upper.value()));
    }
    if (progress) progress(++done, total);
  });
  return result;
}

}  // namespace swarmcert::analysis
