#include "analysis/firmware/golden_vectors.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "nn/base/input_error.h"
#include "nn/base/random.h"
#include "nn/weights/functions.h"

namespace swarmcert::firmware {
namespace {

/// Own state of the ground's phi; neighbours' states lie in the clamp, or in +-1 m and +-2 m/s where there is none.
constexpr float kMostPosition_m = 1, kMostVelocity_m_s = 2;

/// The network as the exported source evaluates it.
class FlightEvaluator {
 public:
  FlightEvaluator(const files::Network& network, int most_neighbours)
      : most_(most_neighbours), scale_(newton_per_unit(network)), of_invariants_(network.invariants) {
    for (const auto& [part, weights] : files::parts(network)) evaluators_.emplace(part, *weights);
    for (const std::string& kind : neighbour_kinds(network))
      phi_.push_back(evaluators_.at(files::phi_name(kind)).mlp());
    if (network.phi.count(files::kGroundKind) != 0) {
      ground_ = evaluators_.at(files::kGroundPhi).mlp();
      has_ground_ = true;
    }
    if (network.clamp) {
      lower_.assign(network.clamp->lower.begin(), network.clamp->lower.end());
      upper_.assign(network.clamp->upper.begin(), network.clamp->upper.end());
    }
  }

  /// Fills in status and force.
  void run(const std::string& rho_kind, GoldenVector& vector) const {
    const nn::DeepSet<float> set{has_ground_ ? &ground_ : nullptr,
                                 phi_.data(),
                                 static_cast<int>(phi_.size()),
                                 evaluators_.at(files::rho_name(rho_kind)).mlp(),
                                 lower_.empty() ? nullptr : lower_.data(),
                                 upper_.empty() ? nullptr : upper_.data(),
                                 of_invariants_};
    std::vector<nn::Neighbour<float>> neighbours;
    for (std::size_t j = 0; j < vector.inputs.size(); ++j)
      neighbours.push_back({vector.inputs[j].data(), vector.kinds[j]});
    std::vector<float> copies(static_cast<std::size_t>(most_ * set.phi_inputs()));
    std::vector<int> order(static_cast<std::size_t>(most_));
    std::vector<float> sum(static_cast<std::size_t>(set.hidden()));
    std::vector<float> scratch(static_cast<std::size_t>(scratch_size(set)));
    std::vector<float> output(static_cast<std::size_t>(set.outputs()));
    vector.status = nn::evaluate(
        set, vector.own.data(), neighbours.data(), static_cast<int>(neighbours.size()), output.data(),
        nn::DeepSetWorkspace<float>{copies.data(), order.data(), most_, sum.data(), scratch.data()});
    vector.force_N = nn::rounded(output.front() * scale_);
  }

 private:
  int most_;
  float scale_;
  bool of_invariants_;
  std::map<std::string, files::Evaluator<float>> evaluators_;
  std::vector<nn::Mlp<float>> phi_;
  nn::Mlp<float> ground_{};
  bool has_ground_ = false;
  std::vector<float> lower_, upper_;
};

}  // namespace

std::vector<std::string> neighbour_kinds(const files::Network& network) {
  std::vector<std::string> kinds;
  for (const auto& [kind, weights] : network.phi) {
    if (kind != files::kGroundKind) kinds.push_back(kind);
  }
  return kinds;
}

float newton_per_unit(const files::Network& network) {
  files::require_force_z(network);
  return network.output_unit == "N" ? 1.0f : 9.81e-3f;
}

std::vector<GoldenVector> golden_vectors(const files::Network& network, int count, int most_neighbours,
                                         std::uint64_t seed) {
  const std::vector<std::string> kinds = neighbour_kinds(network);
  const int inputs = files::inputs(network, files::set_name(kinds.front(), network.rho.begin()->first));
  const FlightEvaluator evaluator(network, most_neighbours);
  files::Random random(seed);
  const auto within = [&](float range) { return range * static_cast<float>(random.symmetric()); };
  std::vector<GoldenVector> result;
  int own_kind = 0;
  for (const auto& [rho_kind, weights] : network.rho) {
    for (int g = 0; g < count; ++g) {
      GoldenVector vector;
      vector.own_kind = own_kind;
      for (int i = 0; i < files::kGroundInputs; ++i)
        vector.own.push_back(within(i == 0 ? kMostPosition_m : kMostVelocity_m_s));
      vector.inputs.resize(static_cast<std::size_t>(g % (most_neighbours + 1)));
      for (std::vector<float>& input : vector.inputs) {
        for (int i = 0; i < inputs; ++i) {
          const bool has_clamp = network.clamp && !network.invariants;  // one of invariants limits no state
          const double side =
              !has_clamp ? 0 : std::max(std::abs(network.clamp->lower[i]), std::abs(network.clamp->upper[i]));
          const float range = has_clamp ? static_cast<float>(1.5 * std::min(side, 1e3))
                                        : (i < 3 ? kMostPosition_m : kMostVelocity_m_s);
          input.push_back(within(range));
        }
        vector.kinds.push_back(static_cast<int>(random.below(kinds.size())));
      }
      evaluator.run(rho_kind, vector);
      result.push_back(std::move(vector));
    }
    ++own_kind;
  }
  return result;
}

}  // namespace swarmcert::firmware
