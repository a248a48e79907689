#include "analysis/identification/evidence/noise_model.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace swarmcert::evidence {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kTimes_s[] = {0.02, 0.06, 0.2, 0.6, 2, 6};
/// Precision of the prior of ln a, whose mean is kBelow under that of the floor.
constexpr double kPrecision = 0.01, kBelow = 4;
constexpr int kSteps = 40;

}  // namespace

NoiseModel::NoiseModel(const std::vector<Band>& bands, const Eigen::Vector3d& floor_N2)
    : counts_(3 * static_cast<Eigen::Index>(bands.size())) {
  int cell = 0;
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t first = 0, end = 0; first < bands.size(); first = end) {
      while (end < bands.size() && bands[end].source == bands[first].source) ++end;
      Channel channel{cell, static_cast<int>(end - first), floor_N2[axis], {}};
      channel.shapes.resize(kShapes, channel.count);
      for (int i = 0; i < channel.count; ++i) {
        const Band& band = bands[first + static_cast<std::size_t>(i)];
        counts_[cell++] = band.count;
        const double turn = std::pow(2 * band.frequency_hz * band.step_s, 2);  // 1 at the Nyquist frequency
        const double w = 2 * kPi * std::max(band.frequency_hz, 0.02);
        channel.shapes.col(i).head<3>() << 1, turn + 1e-9, turn * turn + 1e-9;
        for (int k = 3; k < kShapes; ++k) channel.shapes(k, i) = 1 / (1 + std::pow(w * kTimes_s[k - 3], 2));
      }
      channels_.push_back(std::move(channel));
    }
  }
}

NoiseModel::Shares NoiseModel::start(const Channel& channel, const Eigen::VectorXd& squares_N2,
                                     const Eigen::VectorXd& counts) {
  std::vector<double> mean;
  for (int i = channel.first; i < channel.first + channel.count; ++i)
    mean.push_back(squares_N2[i] / std::max(counts[i], 1.0));
  const auto middle = mean.begin() + static_cast<std::ptrdiff_t>(mean.size() / 2);
  std::nth_element(mean.begin(), middle, mean.end());
  return Shares::Constant(std::log(std::max(*middle, channel.floor_N2) / kShapes));
}

void NoiseModel::improve(const Channel& channel, const Eigen::VectorXd& squares_N2,
                         const Eigen::VectorXd& counts, Shares& shares) {
  constexpr double kLongest = 1.5;  // of a step of ln a
  const Shares a = shares.array().exp();
  const Eigen::ArrayXd n = counts.segment(channel.first, channel.count);
  const Eigen::ArrayXd S = channel.shapes.transpose() * a;
  const Eigen::VectorXd pull =
      (squares_N2.segment(channel.first, channel.count).array() - n * S) / (2 * S.square());
  const Shares gradient = a.cwiseProduct(channel.shapes * pull) -
                          kPrecision * (shares.array() - std::log(channel.floor_N2) + kBelow).matrix();
  const Eigen::VectorXd weight = n / (2 * S.square());
  Eigen::Matrix<double, kShapes, kShapes> information =
      a.asDiagonal() * (channel.shapes * weight.asDiagonal() * channel.shapes.transpose()) * a.asDiagonal();
  information.diagonal().array() += kPrecision;
  shares += information.ldlt().solve(gradient).cwiseMax(-kLongest).cwiseMin(kLongest);
}

Eigen::VectorXd NoiseModel::power(const Eigen::VectorXd& squares_N2, const Eigen::VectorXd& counts) const {
  Eigen::VectorXd S(counts_.size());
  for (const Channel& channel : channels_) {
    Shares shares = start(channel, squares_N2, counts);
    for (int step = 0; step < kSteps; ++step) improve(channel, squares_N2, counts, shares);
    const Shares a = shares.array().exp();
    S.segment(channel.first, channel.count) = channel.shapes.transpose() * a;
  }
  return S;
}

}  // namespace swarmcert::evidence
