#include "lipschitz/lower/search_network.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "nn/base/interval.h"
#include "nn/base/median.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd matrix(const files::Layer& layer) {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  return Eigen::Map<const RowMajor>(layer.weights.data(), layer.outputs, layer.inputs);
}

VectorXd biases(const files::Layer& layer) {
  return Eigen::Map<const VectorXd>(layer.biases.data(), layer.outputs);
}

SearchStage stage(const files::Layer& layer) {
  return {matrix(layer), biases(layer), std::vector<char>(static_cast<std::size_t>(layer.outputs), 0),
          layer.outputs};
}

/// Builds stage k of the terms side by side. A term without hidden layer k passes its values on.
/// @param widths number of values of each term that enter this stage; updated.
SearchStage side_by_side(const std::vector<Term>& terms, std::size_t k, std::vector<int>& widths) {
  std::vector<SearchStage> parts;
  for (std::size_t j = 0; j < terms.size(); ++j) {
    const std::vector<files::Layer>& layers = terms[j].network->layers;
    if (k + 1 < layers.size()) {
      parts.push_back(stage(layers[k]));
    } else {
      const int width = widths[j];
      parts.push_back({MatrixXd::Identity(width, width), VectorXd::Zero(width),
                       std::vector<char>(static_cast<std::size_t>(width), 1), width});
    }
  }
  Eigen::Index rows = 0;
  Eigen::Index cols = 0;
  for (const SearchStage& part : parts) {
    rows += part.weights.rows();
    cols += part.weights.cols();
  }
  SearchStage result{MatrixXd::Zero(rows, cols), VectorXd(rows), {}, parts.front().moved};
  rows = cols = 0;
  for (std::size_t j = 0; j < parts.size(); ++j) {
    const SearchStage& part = parts[j];
    result.weights.block(rows, cols, part.weights.rows(), part.weights.cols()) = part.weights;
    result.biases.segment(rows, part.weights.rows()) = part.biases;
    result.passes.insert(result.passes.end(), part.passes.begin(), part.passes.end());
    rows += part.weights.rows();
    cols += part.weights.cols();
    widths[j] = static_cast<int>(part.weights.rows());
  }
  return result;
}

std::vector<SearchStage> chain(const SlopeFunction& f, const std::vector<Term>& terms) {
  std::vector<SearchStage> stages;
  if (f.rho == nullptr) {
    for (const files::Layer& layer : f.moved.network->layers) stages.push_back(stage(layer));
    return stages;
  }
  std::size_t deepest = 0;
  std::vector<int> widths;
  for (const Term& term : terms) {
    deepest = std::max(deepest, term.network->layers.size() - 1);
    widths.push_back(term.network->inputs());
  }
  for (std::size_t k = 0; k < deepest; ++k) stages.push_back(side_by_side(terms, k, widths));
  // The first layer of rho applied to the sum of the last layers of the terms.
  SearchStage merged = stage(f.rho->layers.front());
  const MatrixXd first = merged.weights;
  merged.weights.resize(first.rows(), std::accumulate(widths.begin(), widths.end(), Eigen::Index{0}));
  Eigen::Index column = 0;
  for (const Term& term : terms) {
    const files::Layer& last = term.network->layers.back();
    merged.weights.middleCols(column, last.inputs) = first * matrix(last);
    merged.biases += first * biases(last);
    column += last.inputs;
  }
  stages.push_back(std::move(merged));
  for (std::size_t k = 1; k < f.rho->layers.size(); ++k) stages.push_back(stage(f.rho->layers[k]));
  return stages;
}

/// Returns the image of each box under its clamp. Sets `inputs` to a point of the boxes.
std::vector<Interval> reachable(const std::vector<Term>& terms, const std::vector<std::optional<Box>>& boxes,
                                std::vector<double>& inputs) {
  std::vector<Interval> intervals;
  for (std::size_t j = 0; j < terms.size(); ++j) {
    for (int k = 0; k < terms[j].network->inputs(); ++k) {
      Interval box = whole_line();
      if (boxes[j]) box = {boxes[j]->lower[k], boxes[j]->upper[k]};
      Interval seen = box;
      if (terms[j].clamp != nullptr) {
        const double low = terms[j].clamp->lower[k];
        const double high = terms[j].clamp->upper[k];
        seen = {std::clamp(seen.lower, low, high), std::clamp(seen.upper, low, high)};
      }
      intervals.push_back(seen);
      inputs.push_back(std::clamp(std::isfinite(seen.lower) ? seen.lower : 0.0, box.lower, box.upper));
    }
  }
  return intervals;
}

/// Chooses centre and scale of the unbounded variables such that the kinks of the first stage lie at distances of about
/// 1. With columns normalised to unit length, which removes the units, the centre is the regularised least-squares
/// solution of (w_i z + b_i) / |w_i| = 0, and the scale is the median distance of the kinks from it.
void normalise_open(const SearchStage& first, SearchNetwork& network) {
  std::vector<int> open;
  for (int v = 0; v < network.variables(); ++v) {
    if (!network.boxed[v]) open.push_back(v);
  }
  if (open.empty()) return;
  MatrixXd w(first.weights.rows(), static_cast<Eigen::Index>(open.size()));
  VectorXd length(w.cols());
  for (Eigen::Index v = 0; v < w.cols(); ++v) {
    w.col(v) = first.weights.col(open[static_cast<std::size_t>(v)]);
    length[v] = w.col(v).norm();
    if (!(length[v] > 0 && std::isfinite(1 / length[v]))) length[v] = 1;
    w.col(v) /= length[v];
  }
  VectorXd b = first.biases;
  for (Eigen::Index i = 0; i < w.rows(); ++i) {
    const double norm = w.row(i).norm();
    const bool has_kink = norm > 0 && !first.passes[static_cast<std::size_t>(i)];
    w.row(i) *= has_kink ? 1 / norm : 0.0;
    b[i] *= has_kink ? 1 / norm : 0.0;
  }
  MatrixXd normal = w.transpose() * w;
  normal.diagonal().array() += 1e-3 * std::max(normal.diagonal().maxCoeff(), 1e-30);
  const VectorXd centre = -normal.llt().solve(w.transpose() * b);
  const VectorXd residual = w * centre + b;
  std::vector<double> distances;
  for (Eigen::Index i = 0; i < w.rows(); ++i) {
    if (w.row(i).squaredNorm() > 0.5) distances.push_back(std::abs(residual[i]));
  }
  double radius = upper_median(std::move(distances));
  if (!(radius > 0)) radius = 1;
  for (Eigen::Index v = 0; v < w.cols(); ++v) {
    network.centre[open[static_cast<std::size_t>(v)]] = centre[v] / length[v];
    network.scale[open[static_cast<std::size_t>(v)]] = radius / length[v];
  }
}

}  // namespace

int SearchNetwork::neurons() const {
  Eigen::Index count = 0;
  for (std::size_t k = 0; k + 1 < stages.size(); ++k) count += stages[k].weights.rows();
  return static_cast<int>(count);
}

int SearchNetwork::moved_variables() const {
  const auto end = std::lower_bound(coordinate.begin(), coordinate.end(), moved_inputs);
  return static_cast<int>(end - coordinate.begin());
}

VectorXd SearchNetwork::inputs(const VectorXd& z) const {
  VectorXd result = fixed_inputs;
  for (int v = 0; v < variables(); ++v) result[coordinate[v]] = centre[v] + scale[v] * z[v];
  return result;
}

VectorXd SearchNetwork::value(const std::vector<float>& inputs) const {
  VectorXd h(variables());
  for (int v = 0; v < variables(); ++v) h[v] = (inputs[coordinate[v]] - centre[v]) / scale[v];
  for (const SearchStage& stage : stages) {
    if (&stage != &stages.front()) {
      const std::vector<char>& passes = (&stage - 1)->passes;
      for (Eigen::Index i = 0; i < h.size(); ++i)
        if (!passes[static_cast<std::size_t>(i)]) h[i] = std::max(h[i], 0.0);
    }
    const VectorXd product = stage.weights * h;
    h = product + stage.biases;
  }
  return h;
}

SearchNetwork search_network(const SlopeFunction& f, const std::vector<std::optional<Box>>& boxes,
                             const std::vector<int>& block) {
  std::vector<Term> terms = {f.moved};
  terms.insert(terms.end(), f.others.begin(), f.others.end());
  SearchNetwork result;
  result.stages = chain(f, terms);
  result.moved_inputs = f.moved.network->inputs();

  std::vector<double> inputs;
  const std::vector<Interval> intervals = reachable(terms, boxes, inputs);
  result.fixed_inputs = Eigen::Map<const VectorXd>(inputs.data(), static_cast<Eigen::Index>(inputs.size()));
  VectorXd seen(result.fixed_inputs.size());  // the fixed coordinates after the clamp
  std::vector<double> centre, scale;
  for (std::size_t i = 0; i < intervals.size(); ++i) {
    const auto [lower, upper] = intervals[i];
    const auto k = static_cast<int>(i);
    seen[k] = lower;
    if (!(lower < upper)) continue;
    seen[k] = 0;
    if (k < result.moved_inputs && (block.empty() || std::count(block.begin(), block.end(), k) > 0)) {
      result.block.push_back(result.variables());
    }
    const bool bounded = std::isfinite(lower) && std::isfinite(upper);
    result.coordinate.push_back(k);
    result.boxed.push_back(bounded);
    centre.push_back(bounded ? lower / 2 + upper / 2 : 0.0);
    scale.push_back(bounded ? upper / 2 - lower / 2 : 1.0);
  }
  result.centre = Eigen::Map<const VectorXd>(centre.data(), static_cast<Eigen::Index>(centre.size()));
  result.scale = Eigen::Map<const VectorXd>(scale.data(), static_cast<Eigen::Index>(scale.size()));

  SearchStage& first = result.stages.front();
  first.biases += first.weights * seen;
  MatrixXd weights(first.weights.rows(), result.variables());
  for (int v = 0; v < result.variables(); ++v) weights.col(v) = first.weights.col(result.coordinate[v]);
  first.weights = std::move(weights);
  for (int v = 0; v < result.variables(); ++v) {
    if (result.boxed[v]) first.biases += first.weights.col(v) * result.centre[v];
  }
  normalise_open(first, result);
  for (int v = 0; v < result.variables(); ++v) {
    if (!result.boxed[v]) first.biases += first.weights.col(v) * result.centre[v];
    first.weights.col(v) *= result.scale[v];
  }
  return result;
}

}  // namespace swarmcert::lipschitz
