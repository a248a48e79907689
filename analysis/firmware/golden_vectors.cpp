#include "analysis/firmware/golden_vectors.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "nn/base/input_error.h"
#include "nn/base/random.h"
#include "nn/weights/compositions.h"
#include "nn/weights/functions.h"

namespace swarmcert::firmware {
namespace {

/// Range of the own state for the ground's phi. Neighbours' states lie in the clamp, or in this range if there is none.
constexpr float kMostPosition_m = 1, kMostVelocity_m_s = 2;

/// Random states of the vehicle and of its neighbours, which have random kinds if `kinds` is empty.
GoldenVector random_vector(const files::Network& network, int neighbours, std::vector<int> kinds,
                           files::Random& random) {
  const auto within = [&](float range) { return range * static_cast<float>(random.symmetric()); };
  const std::vector<std::string> known = files::neighbour_kinds(network);
  const int inputs =
      files::inputs(network, files::FunctionId::set(known.front(), network.rho.begin()->first));
  GoldenVector vector;
  for (int i = 0; i < files::kGroundInputs; ++i)
    vector.own.push_back(within(i == 0 ? kMostPosition_m : kMostVelocity_m_s));
  vector.inputs.resize(static_cast<std::size_t>(neighbours));
  const bool draws_kinds = kinds.empty();
  for (std::vector<float>& input : vector.inputs) {
    for (int i = 0; i < inputs; ++i) {
      const double side =
          !network.clamp ? 0 : std::max(std::abs(network.clamp->lower[i]), std::abs(network.clamp->upper[i]));
      const float range = network.clamp ? static_cast<float>(1.5 * std::min(side, 1e3))
                                        : (i < 3 ? kMostPosition_m : kMostVelocity_m_s);
      input.push_back(within(range));
    }
    if (draws_kinds) kinds.push_back(static_cast<int>(random.below(known.size())));
  }
  vector.kinds = std::move(kinds);
  return vector;
}

/// The neighbours' kinds in each silent composition, as indices.
std::vector<std::vector<int>> silent_kinds(const files::Network& network, const std::string& own) {
  const std::vector<int> counts = files::silent_counts(network, own);
  const std::size_t kinds = files::neighbour_kinds(network).size();
  std::vector<std::vector<int>> result(counts.size() / kinds);
  for (std::size_t i = 0; i < counts.size(); ++i)
    result[i / kinds].insert(result[i / kinds].end(), static_cast<std::size_t>(counts[i]),
                             static_cast<int>(i % kinds));
  return result;
}

}  // namespace

FlightEvaluator::FlightEvaluator(const files::Network& network, int most_neighbours)
    : network_(network), most_(most_neighbours), scale_(newton_per_unit(network)) {
  for (const auto& [part, weights] : files::parts(network)) evaluators_.emplace(part, *weights);
  for (const std::string& kind : files::neighbour_kinds(network))
    phi_.push_back(evaluators_.at(files::FunctionId::phi(kind)).mlp());
  if (network.phi.count(files::kGroundKind) != 0) {
    ground_ = evaluators_.at(files::FunctionId::ground_phi()).mlp();
    has_ground_ = true;
  }
  if (network.clamp) {
    lower_.assign(network.clamp->lower.begin(), network.clamp->lower.end());
    upper_.assign(network.clamp->upper.begin(), network.clamp->upper.end());
  }
}

void FlightEvaluator::run(const std::string& rho_kind, GoldenVector& vector) const {
  const std::vector<int> silent = files::silent_counts(network_, rho_kind);
  const nn::DeepSet<float> set{has_ground_ ? &ground_ : nullptr,
                               phi_.data(),
                               static_cast<int>(phi_.size()),
                               evaluators_.at(files::FunctionId::rho(rho_kind)).mlp(),
                               lower_.empty() ? nullptr : lower_.data(),
                               upper_.empty() ? nullptr : upper_.data(),
                               silent.data(),
                               static_cast<int>(silent.size() / phi_.size())};
  std::vector<nn::Neighbour<float>> neighbours;
  for (std::size_t j = 0; j < vector.inputs.size(); ++j)
    neighbours.push_back({vector.inputs[j].data(), vector.kinds[j]});
  std::vector<float> copies(static_cast<std::size_t>(most_ * set.inputs()));
  std::vector<int> order(static_cast<std::size_t>(most_));
  std::vector<float> sum(static_cast<std::size_t>(set.hidden()));
  std::vector<float> scratch(static_cast<std::size_t>(scratch_size(set)));
  std::vector<float> output(static_cast<std::size_t>(set.outputs()));
  vector.status = nn::evaluate(
      set, vector.own.data(), neighbours.data(), static_cast<int>(neighbours.size()), output.data(),
      nn::DeepSetWorkspace<float>{copies.data(), order.data(), most_, sum.data(), scratch.data()});
  vector.force_N = nn::rounded(output.front() * scale_);
}

float newton_per_unit(const files::Network& network) {
  files::require_force_z(network);
  return network.output_unit == "N" ? 1.0f : 9.81e-3f;
}

std::vector<GoldenVector> golden_vectors(const files::Network& network, int count, int most_neighbours,
                                         std::uint64_t seed) {
  const FlightEvaluator evaluator(network, most_neighbours);
  files::Random random(seed);
  std::vector<GoldenVector> result;
  int own_kind = 0;
  for (const auto& [rho_kind, weights] : network.rho) {
    const auto add = [&, &own = rho_kind](int neighbours, const std::vector<int>& kinds) {
      result.push_back(random_vector(network, neighbours, kinds, random));
      result.back().own_kind = own_kind;
      evaluator.run(own, result.back());
    };
    for (int g = 0; g < count; ++g) add(g % (most_neighbours + 1), {});
    for (const std::vector<int>& kinds : silent_kinds(network, rho_kind)) {
      const auto neighbours = static_cast<int>(kinds.size());
      if (neighbours <= most_neighbours) add(neighbours, kinds);
    }
    ++own_kind;
  }
  return result;
}

}  // namespace swarmcert::firmware
