#include "lipschitz/values/extremes.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <queue>
#include <vector>

#include "nn/base/doubles.h"
#include "nn/base/parallel.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

/// Boxes halved between two looks at the queue: fixed, so that the search is the same for any number of threads.
constexpr int kHalvedAtOnce = 8;

struct MaximumPart {
  double upper = 0;
  std::shared_ptr<const Reach> reach;
  Index split = 0;
  bool can_be_halved = false;
  std::vector<VectorXd> tried;  ///< points of the box
  bool operator<(const MaximumPart& other) const { return upper < other.upper; }
};

VectorXd as_vector(const std::vector<double>& values) {
  return Eigen::Map<const VectorXd>(values.data(), static_cast<Index>(values.size()));
}

MaximumPart maximum_part(const ReachNetwork& network, const RowVectorXd& direction, const Box& box,
                         const MaximumPart* around) {
  MaximumPart part;
  part.reach = std::make_shared<const Reach>(network, box, around != nullptr ? around->reach.get() : nullptr);
  const LinearForms form = part.reach->sharpened_form(direction);
  part.upper = part.reach->largest(form)(0);
  if (around != nullptr) part.upper = std::min(part.upper, around->upper);
  const VectorXd lower = as_vector(box.lower), upper = as_vector(box.upper);
  VectorXd corner = lower;
  for (Index i = 0; i < corner.size(); ++i)
    if (form.rows(0, i) > 0) corner(i) = upper(i);
  part.tried = {corner, (lower + upper) / 2};
  const VectorXd gain = part.reach->influence(direction).cwiseProduct(upper - lower);
  part.can_be_halved = gain.maxCoeff(&part.split) > 0;
  return part;
}

}  // namespace

Maximum maximise(const ReachNetwork& network, const RowVectorXd& direction, const Box& box,
                 const MaximiseOptions& options) {
  Maximum best;
  best.value = -kInfinity;
  const auto take = [&](const MaximumPart& part) {
    ++best.nodes;
    for (const VectorXd& x : part.tried) {
      const double value = direction.dot(evaluate_roughly(network, x));
      if (value > best.value) best.value = value, best.x = x;
    }
  };
  std::priority_queue<MaximumPart> queue;
  queue.push(maximum_part(network, direction, box, nullptr));
  take(queue.top());
  while (queue.top().upper > best.value + options.gap * std::abs(best.value)) {
    std::vector<MaximumPart> halved;
    while (!queue.empty() && queue.top().can_be_halved && static_cast<int>(halved.size()) < kHalvedAtOnce &&
           best.nodes + 2 * static_cast<int>(halved.size() + 1) <= options.nodes) {
      halved.push_back(queue.top());
      queue.pop();
    }
    if (halved.empty()) break;
    std::vector<MaximumPart> children(2 * halved.size());
    files::parallel_for(static_cast<int>(halved.size()), options.jobs, [&](int index) {
      const auto i = static_cast<std::size_t>(index);
      const auto [first, second] = halves(halved[i].reach->box(), halved[i].split);
      children[2 * i] = maximum_part(network, direction, first, &halved[i]);
      children[2 * i + 1] = maximum_part(network, direction, second, &halved[i]);
    });
    for (MaximumPart& child : children) {
      take(child);
      queue.push(std::move(child));
    }
  }
  best.upper = queue.top().upper;
  return best;
}

Hull hull(const ReachNetwork& network, const Box& box, int nodes) {
  struct Part {
    double norm;
    std::shared_ptr<const Reach> reach;
    bool operator<(const Part& other) const { return norm < other.norm; }
  };
  const auto part_of = [&](const Box& part, const Reach* around) {
    auto reach = std::make_shared<const Reach>(network, part, around);
    const double norm = (1 + 1e-9) * reach->output().magnitude().norm();
    return Part{std::isnan(norm) ? kInfinity : norm, std::move(reach)};
  };
  std::priority_queue<Part> queue;
  queue.push(part_of(box, nullptr));
  for (int done = 1; done + 2 <= nodes; done += 2) {
    const Part top = queue.top();
    const VectorXd widths = as_vector(top.reach->box().upper) - as_vector(top.reach->box().lower);
    Index k = 0;
    // Widths relative to the whole box, so that units do not matter.
    const VectorXd whole = (as_vector(box.upper) - as_vector(box.lower)).cwiseMax(1e-300);
    if (!(widths.cwiseQuotient(whole).maxCoeff(&k) > 0)) break;
    queue.pop();
    const auto [first, second] = halves(top.reach->box(), k);
    for (const Box& piece : {first, second}) queue.push(part_of(piece, top.reach.get()));
  }
  Hull result{queue.top().reach->output(), queue.top().norm};
  for (; !queue.empty(); queue.pop()) {
    const Bounds& bounds = queue.top().reach->output();
    result.bounds.lower = result.bounds.lower.cwiseMin(bounds.lower);
    result.bounds.upper = result.bounds.upper.cwiseMax(bounds.upper);
  }
  return result;
}

}  // namespace swarmcert::lipschitz
