#include "lipschitz/values/part_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <queue>
#include <utility>

#include "lipschitz/checker/products.h"
#include "lipschitz/values/relu_lines.h"
#include "nn/base/doubles.h"
#include "nn/base/parallel.h"
#include "nn/base/random.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

/// Parts that are kept, at most: about two kilobytes each.
constexpr std::size_t kMostPartsOfTree = 100000;
/// Parts that a form has halved between two looks at its queue: fixed, for the same result with any number of threads.
constexpr int kPartsHalvedAtOnce = 16;
constexpr Index kClimbSamples = 2000;
/// Searches that are kept, to go on where the same form is asked for again.
constexpr std::size_t kMostForms = 2000;

VectorXd ends(const std::vector<double>& values) {
  return Eigen::Map<const VectorXd>(values.data(), static_cast<Index>(values.size()));
}

/// Points of the box, half of their coordinates at an end.
MatrixXd sample_points(const Box& box) {
  files::Random random(1);
  MatrixXd points(static_cast<Index>(box.lower.size()), kClimbSamples);
  for (Index sample = 0; sample < kClimbSamples; ++sample)
    for (Index k = 0; k < points.rows(); ++k) {
      const auto i = static_cast<std::size_t>(k);
      const double share = std::clamp(2 * random.uniform() - 0.5, 0.0, 1.0);
      points(k, sample) =
          std::clamp(box.lower[i] + share * (box.upper[i] - box.lower[i]), box.lower[i], box.upper[i]);
    }
  return points;
}

MatrixXd outputs_at(const ReachNetwork& network, MatrixXd x) {
  for (const ReachLayer& layer : network) {
    x = ((layer.weights * x).colwise() + layer.bias).eval();
    if (layer.has_relu) x = x.cwiseMax(0.0);
  }
  return x;
}

}  // namespace

struct PartTree::Form {
  RowVectorXd direction;
  RowVectorXd coefficients;  ///< of what the last hidden layer gives
  Left left;
  std::priority_queue<std::pair<double, std::size_t>> queue;  ///< what is left: upper bound and part
  double value = 0;
  VectorXd x;
  double spread = 0;  ///< about how far its values are apart
  int halved = 0;
};

struct PartTree::Seen {
  double upper[2], value;
  VectorXd x;
};

struct PartTree::Scratch {
  RowVectorXd coefficients, next;
  VectorXd x;
};

PartTree::~PartTree() = default;

PartTree::PartTree(const ReachNetwork& network, const Box& box) : network_(network) {
  const Reach whole(network, box);
  relative_ = whole.rounding();
  for (std::size_t j = 0; j < network.size(); ++j)
    layers_.push_back({network[j].weights, network[j].bias, whole.layer_error(j),
                       4 * kUnit * whole.before_relu(j).magnitude()});
  parts_.emplace_back();
  parts_[0] = part_of(box, nullptr);
  points_ = sample_points(box);
  sampled_ = outputs_at(network, points_);
}

PartTree::Part PartTree::part_of(const Box& box, const Reach* around) const {
  Part part;
  part.box = box;
  part.reach = std::make_shared<const Reach>(network_, box, around);
  for (std::size_t j = 0; j + 1 < network_.size(); ++j) {
    const ReluLines lines = part.reach->lines(j);
    part.lines.emplace_back();
    for (std::size_t n = 0; n < lines.neurons.size(); ++n)
      part.lines.back().push_back(
          {lines.slope(static_cast<Index>(n)), lines.offset(static_cast<Index>(n)), lines.neurons[n]});
  }
  return part;
}

/// Across the dimension along which the form may change most.
void PartTree::halve(std::size_t index, const RowVectorXd& form) {
  Part& part = parts_[index];
  const VectorXd widths = ends(part.box.upper) - ends(part.box.lower);
  Index k = 0;
  if (!(part.reach->influence(form).cwiseProduct(widths).maxCoeff(&k) > 0)) widths.maxCoeff(&k);
  const auto [first, second] = halves(part.box, k);
  parts_[part.first_child] = part_of(first, part.reach.get());
  parts_[part.first_child + 1] = part_of(second, part.reach.get());
  part.reach.reset();
}

/// Takes a form through hidden layer j, whose coefficients it has behind the ReLU: next += v' W, row by row, where v'
/// is what a neuron's line makes of its coefficient v (relu_lines.h).
SWARMCERT_WIDE void PartTree::pull_back(const Layer& layer, const std::vector<Line>& lines, double relative,
                                        const double* __restrict coefficients, double* __restrict next,
                                        Left& left) {
  const double* const __restrict weights = layer.weights.data();
  const Index inputs = layer.weights.cols();
  for (const Line& line : lines) {
    double v = coefficients[line.neuron];
    if (v > 0) {
      left.constant += v * line.offset;
      left.error += v * (relative * line.offset + line.slope * layer.line_error(line.neuron));
      v *= line.slope;
    } else if (v <= 0 && line.slope <= 0.5) {
      continue;  // the lower line is zero; false for NaN
    }
    left.constant += v * layer.bias(line.neuron);
    left.error += std::abs(v) * layer.error(line.neuron);
    const double* const __restrict row = weights + line.neuron * inputs;
    for (Index i = 0; i < inputs; ++i) next[i] += v * row[i];
  }
}

double PartTree::above(const Part& part, const Form& form, Scratch& scratch) const {
  Left left = form.left;
  scratch.coefficients = form.coefficients;
  for (std::size_t j = network_.size() - 1; j-- > 0;) {
    scratch.next.setZero(layers_[j].weights.cols());
    pull_back(layers_[j], part.lines[j], relative_, scratch.coefficients.data(), scratch.next.data(), left);
    scratch.coefficients.swap(scratch.next);
  }
  scratch.x.resize(scratch.coefficients.size());
  double most = left.constant + (1 + 1e-9) * left.error, size = std::abs(most);
  for (Index k = 0; k < scratch.x.size(); ++k) {
    const double lower = part.box.lower[static_cast<std::size_t>(k)];
    const double upper = part.box.upper[static_cast<std::size_t>(k)];
    const double coefficient = scratch.coefficients(k);
    scratch.x(k) = coefficient > 0 ? upper : lower;
    most += coefficient * scratch.x(k);
    size += std::abs(coefficient * scratch.x(k));
  }
  const double relative = 4 * static_cast<double>(scratch.x.size() + 8) * kUnit;
  most = up(most + relative * size + 0x1p-900);
  return std::isnan(most) ? kInfinity : most;
}

PartTree::Seen PartTree::look(const Part& first, const Part& second, const Form& form,
                              Scratch& scratch) const {
  Seen seen;
  seen.upper[0] = above(first, form, scratch);
  seen.x = scratch.x;
  seen.upper[1] = above(second, form, scratch);
  if (seen.upper[1] > seen.upper[0]) seen.x = scratch.x;
  seen.value = form.direction.dot(evaluate_roughly(network_, seen.x));
  return seen;
}

PartTree::Form& PartTree::form_of(const RowVectorXd& direction) {
  const auto [found, is_new] =
      forms_.try_emplace(std::vector<double>(direction.data(), direction.data() + direction.size()));
  Form& form = found->second;
  if (!is_new) return form;
  form.direction = direction;
  // Off by no more than the order of summation allows, which the error covers.
  form.coefficients = direction * layers_.back().weights;
  form.left.constant = direction.dot(layers_.back().bias);
  form.left.error = direction.cwiseAbs().dot(layers_.back().error);
  const RowVectorXd values = direction * sampled_;
  Index best = 0;
  form.value = values.maxCoeff(&best);
  form.x = points_.col(best);
  form.spread = form.value - values.minCoeff();
  Scratch scratch;
  form.queue.emplace(above(parts_[0], form, scratch), 0);
  return form;
}

void PartTree::choose(std::size_t index, Form& form, const PartSearch& search, Work& wanted) {
  for (int i = 0; i < kPartsHalvedAtOnce && !form.queue.empty() && form.halved < search.halved; ++i) {
    const auto [upper, part] = form.queue.top();
    if (!(upper > form.value + search.gap * form.spread)) return;
    if (parts_[part].first_child == 0) {
      if (parts_.size() + 2 > kMostPartsOfTree || parts_[part].box.lower == parts_[part].box.upper) return;
      parts_[part].first_child = parts_.size();
      parts_.resize(parts_.size() + 2);
    }
    ++form.halved;
    form.queue.pop();
    wanted[part].push_back({index, upper});
  }
}

void PartTree::refine(const std::vector<Form*>& forms, const Work& wanted, int jobs) {
  const std::vector<std::pair<std::size_t, std::vector<Wanted>>> work(wanted.begin(), wanted.end());
  std::vector<std::vector<Seen>> seen(work.size());
  files::parallel_for(static_cast<int>(work.size()), jobs, [&](int item) {
    const auto& [part, asking] = work[static_cast<std::size_t>(item)];
    const std::size_t child = parts_[part].first_child;
    if (parts_[child].box.lower.empty()) halve(part, forms[asking.front().form]->direction);
    Scratch scratch;
    for (const Wanted& one : asking)
      seen[static_cast<std::size_t>(item)].push_back(
          look(parts_[child], parts_[child + 1], *forms[one.form], scratch));
  });
  for (std::size_t item = 0; item < work.size(); ++item)
    for (std::size_t i = 0; i < seen[item].size(); ++i) {
      const Wanted& one = work[item].second[i];
      Form& form = *forms[one.form];
      const Seen& both = seen[item][i];
      if (both.value > form.value) form.value = both.value, form.x = both.x;
      for (const std::size_t half : {0, 1})
        form.queue.emplace(std::min(one.upper, both.upper[half]),
                           parts_[work[item].first].first_child + half);
    }
}

LargestValues PartTree::largest(const MatrixXd& forms, const PartSearch& search) {
  if (forms_.size() > kMostForms) forms_.clear();
  std::vector<Form*> searched;
  for (Index row = 0; row < forms.rows(); ++row)
    searched.push_back(
        &form_of(forms.row(row).allFinite() ? RowVectorXd(forms.row(row)) : RowVectorXd::Zero(forms.cols())));
  while (true) {
    Work wanted;
    for (std::size_t form = 0; form < searched.size(); ++form) choose(form, *searched[form], search, wanted);
    if (wanted.empty()) break;
    refine(searched, wanted, search.jobs);
  }
  LargestValues result{VectorXd(forms.rows()), VectorXd(forms.rows()),
                       MatrixXd(points_.rows(), forms.rows())};
  for (Index row = 0; row < forms.rows(); ++row) {
    const Form& form = *searched[static_cast<std::size_t>(row)];
    result.upper(row) = forms.row(row).allFinite() ? form.queue.top().first : kInfinity;
    result.value(row) = form.value;
    result.x.col(row) = form.x;
  }
  return result;
}

}  // namespace swarmcert::lipschitz
