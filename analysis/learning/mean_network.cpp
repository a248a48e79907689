#include "analysis/learning/mean_network.h"

#include <cmath>
#include <stdexcept>

#include "nn/weights/function_id.h"

namespace swarmcert::learning {
namespace {

using Eigen::Index;
using training::Part;

/// Copies layer `layer` of part `part` of member k to its position in `theta`.
void place(const training::Layout& one, const training::Vector& member, const training::Layout& wide,
           int part, int layer, Index k, Index members, training::Vector& theta) {
  const auto from = one.weights(member, part, layer);
  const auto biases = one.biases(member, part, layer);
  auto into = wide.weights(theta, part, layer);
  const bool is_phi = one.parts()[static_cast<std::size_t>(part)].id.is_phi();
  const bool reads_inputs = is_phi && layer == 0;
  const bool adds_up = !is_phi && layer + 1 == one.parts()[static_cast<std::size_t>(part)].layers();
  const auto root = static_cast<float>(std::sqrt(static_cast<double>(members)));
  const Index row = adds_up ? 0 : k * from.rows(), column = reads_inputs ? 0 : k * from.cols();
  into.block(row, column, from.rows(), from.cols()) = from * (reads_inputs ? 1 / root
                                                              : adds_up ? root / static_cast<float>(members)
                                                                        : 1.0f);
  wide.biases(theta, part, layer).segment(row, from.rows()) +=
      biases * (adds_up ? 1 / static_cast<float>(members) : 1 / root);
}

}  // namespace

training::Layout layout_of_mean(const training::Layout& one, int members) {
  if (members < 1) throw std::invalid_argument("layout_of_mean: a mean of no networks");
  std::vector<Part> parts = one.parts();
  for (Part& part : parts) {
    const bool is_phi = part.id.is_phi();
    for (std::size_t k = is_phi ? 1 : 0; k + (is_phi ? 0 : 1) < part.sizes.size(); ++k)
      part.sizes[k] *= members;
  }
  return training::Layout(std::move(parts));
}

training::Vector mean_network(const training::Layout& one, const std::vector<training::Vector>& members) {
  const training::Layout wide = layout_of_mean(one, static_cast<int>(members.size()));
  training::Vector theta = training::Vector::Zero(wide.size());
  for (std::size_t k = 0; k < members.size(); ++k) {
    if (members[k].size() != one.size())
      throw std::invalid_argument("mean_network: the networks have different layouts");
    for (std::size_t p = 0; p < one.parts().size(); ++p) {
      for (int layer = 0; layer < one.parts()[p].layers(); ++layer)
        place(one, members[k], wide, static_cast<int>(p), layer, static_cast<Index>(k),
              static_cast<Index>(members.size()), theta);
    }
  }
  return theta;
}

}  // namespace swarmcert::learning
