#include "lipschitz/lower/linear_region.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "nn/base/doubles.h"
#include "nn/base/random.h"

namespace swarmcert::lipschitz {

using Eigen::MatrixXd;
using Eigen::VectorXd;

std::uint64_t pattern_key(int neuron) {
  return files::Random(0x5bd1e995u + static_cast<std::uint64_t>(neuron)).bits();
}

MatrixXd gram(const MatrixXd& jacobian) {
  if (jacobian.cols() <= jacobian.rows()) return jacobian.transpose() * jacobian;
  return jacobian * jacobian.transpose();
}

MatrixXd block_columns(const SearchNetwork& network, const MatrixXd& full) {
  MatrixXd result(full.rows(), static_cast<Eigen::Index>(network.block.size()));
  for (Eigen::Index c = 0; c < result.cols(); ++c) {
    const int v = network.block[static_cast<std::size_t>(c)];
    result.col(c) = full.col(v) / network.scale[v];
  }
  return result;
}

LinearRegion linear_region(const SearchNetwork& network, const VectorXd& z) {
  const int neurons = network.neurons();
  LinearRegion region;
  region.distances.resize(neurons);
  region.lengths.resize(neurons);
  region.normals.resize(z.size(), neurons);
  region.effects.resize(network.outputs(), neurons);
  region.on.resize(static_cast<std::size_t>(neurons));
  region.moved.resize(static_cast<std::size_t>(neurons));
  VectorXd values = z;
  MatrixXd gradients;  // [width x variables] gradients of the values
  int first = 0;
  for (std::size_t k = 0; k < network.stages.size(); ++k) {
    const SearchStage& stage = network.stages[k];
    values = (stage.weights * values + stage.biases).eval();
    gradients = k == 0 ? stage.weights : MatrixXd(stage.weights * gradients);
    if (k + 1 == network.stages.size()) break;
    for (Eigen::Index i = 0; i < values.size(); ++i) {
      const int neuron = first + static_cast<int>(i);
      const double length = gradients.row(i).norm();
      const bool has_kink = !stage.passes[static_cast<std::size_t>(i)] && length > 0 && values[i] != 0;
      const bool on = stage.passes[static_cast<std::size_t>(i)] || values[i] > 0;
      region.lengths[neuron] = length;
      region.distances[neuron] = has_kink ? values[i] / length : 0.0;
      region.normals.col(neuron) = gradients.row(i).transpose() * (has_kink ? 1 / length : 0.0);
      region.on[static_cast<std::size_t>(neuron)] = on;
      region.moved[static_cast<std::size_t>(neuron)] = i < stage.moved;
      if (on) {
        if (i < stage.moved) region.pattern ^= pattern_key(neuron);
      } else {
        values[i] = 0;
        gradients.row(i).setZero();
      }
    }
    first += static_cast<int>(values.size());
  }
  region.jacobian = block_columns(network, gradients);
  MatrixXd effects = network.stages.back().weights;  // effects of the outputs h of the previous stage
  for (std::size_t k = network.stages.size() - 1; k-- > 0;) {
    const Eigen::Index width = effects.cols();
    first -= static_cast<int>(width);
    region.effects.middleCols(first, width) = effects;
    for (Eigen::Index i = 0; i < width; ++i) {
      if (!region.on[static_cast<std::size_t>(first + i)]) effects.col(i).setZero();
    }
    if (k > 0) effects = (effects * network.stages[k].weights).eval();
  }
  return region;
}

LocalSlope local_slope(const SearchNetwork& network, const VectorXd& z) {
  LocalSlope result{0, 0};
  VectorXd values = z;
  MatrixXd gradients;  // with respect to the block, for the values that depend on it
  int first = 0;
  for (std::size_t k = 0; k < network.stages.size(); ++k) {
    const SearchStage& stage = network.stages[k];
    values = (stage.weights * values + stage.biases).eval();
    if (k == 0) {
      gradients = block_columns(network, stage.weights.topRows(stage.moved));
    } else {
      gradients = (stage.weights.topLeftCorner(stage.moved, gradients.rows()) * gradients).eval();
    }
    if (k + 1 == network.stages.size()) break;
    for (Eigen::Index i = 0; i < values.size(); ++i) {
      const bool on = values[i] > 0 || stage.passes[static_cast<std::size_t>(i)];
      if (!on) values[i] = 0;
      if (i >= stage.moved) continue;
      if (on) {
        result.pattern ^= pattern_key(first + static_cast<int>(i));
      } else {
        gradients.row(i).setZero();
      }
    }
    first += static_cast<int>(values.size());
  }
  if (!gradients.allFinite()) return result;
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(gram(gradients), Eigen::EigenvaluesOnly);
  result.slope = std::sqrt(std::max(0.0, eigen.eigenvalues().maxCoeff()));
  return result;
}

Chord chord(const SearchNetwork& network, const LinearRegion& region, const VectorXd& z,
            const VectorXd& direction) {
  Chord result{-kInfinity, kInfinity};
  const auto hit = [&](double t) {
    if (t > 0) result.upper = std::min(result.upper, t);
    if (t < 0) result.lower = std::max(result.lower, t);
  };
  const VectorXd speeds = region.normals.transpose() * direction;
  for (Eigen::Index i = 0; i < speeds.size(); ++i) {
    if (speeds[i] != 0) hit(-region.distances[i] / speeds[i]);
  }
  for (int v = 0; v < network.variables(); ++v) {
    if (!network.boxed[v] || direction[v] == 0) continue;
    hit((1 - z[v]) / direction[v]);
    hit((-1 - z[v]) / direction[v]);
  }
  return result;
}

}  // namespace swarmcert::lipschitz
