#include "analysis/identification/evidence/shapes.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

namespace swarmcert::evidence {
namespace {

/// A shape parameter of an item that the flights may move off the grid.
struct Free {
  std::size_t index;      ///< of the item in the set
  std::size_t parameter;  ///< in theta
  double step;            ///< to the nearest value of the grid
};

const std::vector<double>& theta_of(const Hypotheses& all, const Item& item) {
  return all.candidates[item.entry].thetas[item.shape];
}

/// Returns the distance from a value to the nearest other one of a grid; 0 without another one.
double spacing(const std::vector<std::vector<double>>& grid, std::size_t shapes, std::size_t parameter,
               double value) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t t = 0; t < shapes; ++t) {
    const double distance = std::abs(grid[t][parameter] - value);
    if (distance > 1e-9 * std::abs(value)) least = std::min(least, distance);
  }
  return std::isfinite(least) ? least : 0;
}

std::vector<Free> free_shapes(const Hypotheses& all, const Set& set) {
  std::vector<Free> result;
  for (std::size_t i = 0; i < set.size(); ++i) {
    const Entry& entry = all.entries[set[i].entry];
    if (entry.kind != Kind::kEffect) continue;
    const identification::Candidate& candidate = all.candidates[set[i].entry];
    for (std::size_t p = 0; p < candidate.info.shape.size(); ++p) {
      const stability::Parameter& parameter = candidate.info.shape[p];
      if (!(parameter.lower < parameter.upper)) continue;
      const double value = theta_of(all, set[i])[p];
      double step = spacing(candidate.thetas, entry.shapes, p, value);
      if (step == 0 && parameter.grid.empty()) continue;
      if (step == 0) step = 0.2 * std::abs(value);
      if (step > 0) result.push_back({i, p, step});
    }
  }
  return result;
}

/// Returns the shapes of the set, each free parameter moved by `by` in turn.
std::vector<Shape> moved_in_turn(const Hypotheses& all, const Set& set, const std::vector<Free>& free,
                                 double by) {
  std::vector<Shape> shapes;
  for (const Free& one : free) {
    Shape shape{set[one.index].entry, theta_of(all, set[one.index])};
    shape.theta[one.parameter] += by * one.step;
    shapes.push_back(std::move(shape));
  }
  return shapes;
}

/// First column of each item among those of the set.
std::vector<Eigen::Index> places(const Hypotheses& all, const Set& set) {
  std::vector<Eigen::Index> result;
  Eigen::Index next = 0;
  for (const Item& item : set) {
    result.push_back(next);
    next += all.entries[item.entry].size;
  }
  return result;
}

/// Returns the Gauss-Newton steps of the free parameters, in steps of the grid.
Eigen::VectorXd steps(const identification::Passes& passes, const Projection& projection,
                      const Hypotheses& all, const Whitened& data, const Weighed& now,
                      const std::vector<Free>& free) {
  constexpr double kDifference = 0.1;
  const EvidenceSearch search(all, data);
  const std::vector<int> columns = search.columns_of(now.set);
  const auto width = static_cast<Eigen::Index>(columns.size());
  const auto parameters = static_cast<Eigen::Index>(free.size());
  Eigen::MatrixXd J(data.data().size(), width + parameters);
  for (Eigen::Index c = 0; c < width; ++c)
    J.col(c) = data.columns().col(columns[static_cast<std::size_t>(c)]).cast<double>();
  const Eigen::MatrixXd moved =
      projection.of(evaluate(passes, all, moved_in_turn(all, now.set, free, kDifference))).cast<double>();
  const std::vector<Eigen::Index> first = places(all, now.set);
  Eigen::Index column = 0;
  for (Eigen::Index p = 0; p < parameters; ++p) {
    const std::size_t index = free[static_cast<std::size_t>(p)].index;
    const Eigen::Index size = all.entries[now.set[index].entry].size;
    J.col(width + p) = (moved.middleCols(column, size) - J.middleCols(first[index], size)) *
                       now.coefficients.segment(first[index], size) / kDifference;
    column += size;
  }
  Eigen::MatrixXd hessian = J.transpose() * J;
  const Prior prior = search.prior_of(now.set);
  Eigen::VectorXd pull = J.transpose() * search.left_by(now);
  pull.head(width) += prior.precision * (prior.mean - now.coefficients);
  hessian.topLeftCorner(width, width) += prior.precision;
  hessian.diagonal().tail(parameters).array() += 1;  // a priori, within about a step of the grid
  return hessian.llt().solve(pull).tail(parameters).cwiseMax(-1).cwiseMin(1);
}

/// Adds the shapes of the set moved by `by` steps, and returns the set with them.
Set moved(const identification::Passes& passes, const Projection& projection, const std::vector<Free>& free,
          const Eigen::VectorXd& by, Hypotheses& all, Whitened& data, Set set) {
  std::vector<Shape> shapes;
  std::vector<std::size_t> of_shape;
  for (std::size_t p = 0; p < free.size(); ++p) {
    const Item& item = set[free[p].index];
    if (shapes.empty() || of_shape.back() != free[p].index) {
      shapes.push_back({item.entry, theta_of(all, item)});
      of_shape.push_back(free[p].index);
    }
    const stability::Parameter& bounds = all.candidates[item.entry].info.shape[free[p].parameter];
    double& value = shapes.back().theta[free[p].parameter];
    value += by[static_cast<Eigen::Index>(p)] * free[p].step;
    value = std::clamp(value, bounds.lower, bounds.upper);
  }
  auto first = static_cast<int>(data.columns().cols());
  const Columns added = evaluate(passes, all, shapes);
  data.append(projection.of(added));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    all.columns[axis].conservativeResize(Eigen::NoChange, data.columns().cols());
    all.columns[axis].rightCols(added[axis].cols()) = added[axis];
  }
  for (std::size_t s = 0; s < shapes.size(); ++s) {
    Entry& entry = all.entries[shapes[s].entry];
    set[of_shape[s]].shape = entry.first_column.size();
    entry.first_column.push_back(first);
    all.candidates[shapes[s].entry].thetas.push_back(shapes[s].theta);
    first += entry.size;
  }
  return set;
}

}  // namespace

Weighed with_free_shapes(const identification::Passes& passes, const Projection& projection, Hypotheses& all,
                         Whitened& data, Weighed best) {
  constexpr int kMostSteps = 6;
  constexpr double kLeast = 0.05;  // nats
  const std::vector<Free> free = free_shapes(all, best.set);
  for (int step = 0; step < kMostSteps && !free.empty(); ++step) {
    Eigen::VectorXd by = steps(passes, projection, all, data, best, free);
    Weighed next = EvidenceSearch(all, data).weigh(moved(passes, projection, free, by, all, data, best.set));
    if (!(next.score > best.score)) {
      by /= 3;
      next = EvidenceSearch(all, data).weigh(moved(passes, projection, free, by, all, data, best.set));
    }
    if (!(next.score > best.score)) break;
    const bool is_little = next.score < best.score + kLeast;
    best = std::move(next);
    if (is_little) break;
  }
  return best;
}

}  // namespace swarmcert::evidence
