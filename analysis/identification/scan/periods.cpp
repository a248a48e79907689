#include "analysis/identification/scan/periods.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <random>

#include "nn/base/pi.h"

namespace swarmcert::identification {
namespace {

constexpr double kPiece_s = 100, kFastest_hz = 2;
constexpr int kMostFrequencies = 400, kDraws = 20;
constexpr Eigen::Index kManySamples_ = 20'000;

/// Samples in pieces, each with one phase.
struct Pieces {
  std::vector<Eigen::Index> rows;  ///< row of ScanSamples
  std::vector<int> of_row, first;  ///< piece of each row; first row of each piece, and the end
  double longest_s = 0;
};

double time_of(const ScanSamples& samples, Eigen::Index row) {
  return samples.values(row, static_cast<Eigen::Index>(ScanVariable::kTime));
}

Pieces pieces_of(const ScanSamples& samples) {
  Pieces pieces;
  const Eigen::Index count = std::min(samples.size(), kManySamples_);
  double start_s = 0;
  int flight = -1;
  for (Eigen::Index i = 0; i < count; ++i) {
    const double now_s = time_of(samples, i);
    const int own = samples.flight[static_cast<std::size_t>(i)];
    if (own != flight || now_s < start_s || now_s - start_s > kPiece_s) {
      pieces.first.push_back(static_cast<int>(i));
      flight = own;
      start_s = now_s;
    }
    pieces.longest_s = std::max(pieces.longest_s, now_s - start_s);
    pieces.rows.push_back(i);
    pieces.of_row.push_back(static_cast<int>(pieces.first.size()) - 1);
  }
  pieces.first.push_back(static_cast<int>(count));
  return pieces;
}

using Draws = std::vector<Eigen::Matrix3Xf>;  ///< [3 x rows] each: the remainder, then random signs

Draws draws_of(const ScanSamples& samples, const Pieces& pieces, const Chunks& chunks) {
  const auto n = static_cast<Eigen::Index>(pieces.rows.size());
  Eigen::Matrix3Xf about_mean = samples.residual.topRows(n).leftCols(3).transpose();
  about_mean.colwise() -= about_mean.rowwise().mean().eval();
  Draws draws = {about_mean};
  for (int d = 0; d < kDraws; ++d) {
    std::mt19937_64 generator(static_cast<std::uint64_t>(d) + 1);
    std::vector<float> sign;
    for (int c = 0; c < chunks.count(); ++c) sign.push_back((generator() & 1) != 0 ? 1.0F : -1.0F);
    draws.push_back(about_mean);
    for (Eigen::Index i = 0; i < n; ++i)
      draws.back().col(i) *= sign[static_cast<std::size_t>(chunks.of_sample[static_cast<std::size_t>(i)])];
  }
  return draws;
}

/// Returns the fraction of the mean square explained by a sine of this frequency, by draw and axis.
Eigen::Matrix3Xd powers_at(double frequency_hz, const ScanSamples& samples, const Pieces& pieces,
                           const Draws& draws) {
  Eigen::Matrix3Xd powers = Eigen::Matrix3Xd::Zero(3, static_cast<Eigen::Index>(draws.size()));
  for (std::size_t p = 0; p + 1 < pieces.first.size(); ++p) {
    const int from = pieces.first[p], to = pieces.first[p + 1];
    Eigen::MatrixX2f waves(to - from, 2);
    for (int i = from; i < to; ++i) {
      const double angle = 2 * kPi * frequency_hz * time_of(samples, i);
      waves(i - from, 0) = static_cast<float>(std::cos(angle));
      waves(i - from, 1) = static_cast<float>(std::sin(angle));
    }
    for (std::size_t d = 0; d < draws.size(); ++d) {
      const Eigen::Matrix<float, 3, 2> sums = draws[d].middleCols(from, to - from) * waves;
      powers.col(static_cast<Eigen::Index>(d)) +=
          sums.cast<double>().rowwise().squaredNorm() * 2 / std::max(to - from, 1);
    }
  }
  for (std::size_t d = 0; d < draws.size(); ++d)
    powers.col(static_cast<Eigen::Index>(d)) /= draws[d].cast<double>().squaredNorm();
  return powers;
}

/// Returns the share on held-out chunks of a sine with a separate phase for each piece.
double judged_share(double frequency_hz, int axis, const ScanSamples& samples, const Pieces& pieces,
                    const Chunks& chunks, const Eigen::Matrix3Xf& remainder) {
  double before = 0, after = 0;
  for (std::size_t p = 0; p + 1 < pieces.first.size(); ++p) {
    std::vector<Eigen::Matrix3d> gram(Chunks::kFolds, Eigen::Matrix3d::Zero());
    std::vector<Eigen::Vector3d> b(Chunks::kFolds, Eigen::Vector3d::Zero());
    std::vector<double> squares(Chunks::kFolds, 0);
    int order = -1, last = -1;
    for (int i = pieces.first[p]; i < pieces.first[p + 1]; ++i) {
      const int chunk = chunks.of_sample[static_cast<std::size_t>(i)];
      if (chunk != last) ++order;
      last = chunk;
      const auto f = static_cast<std::size_t>(order % Chunks::kFolds);
      const double angle = 2 * kPi * frequency_hz * time_of(samples, i), value = remainder(axis, i);
      const Eigen::Vector3d x(std::cos(angle), std::sin(angle), 1);
      gram[f] += x * x.transpose();
      b[f] += value * x;
      squares[f] += value * value;
    }
    for (std::size_t f = 0; f < Chunks::kFolds; ++f) {
      Eigen::Matrix3d others = 1e-6 * Eigen::Matrix3d::Identity();
      Eigen::Vector3d side = Eigen::Vector3d::Zero();
      for (std::size_t g = 0; g < Chunks::kFolds; ++g) {
        if (g == f) continue;
        others += gram[g];
        side += b[g];
      }
      const Eigen::Vector3d c = others.ldlt().solve(side);
      before += squares[f];
      after += squares[f] - 2 * c.dot(b[f]) + c.dot(gram[f] * c);
    }
  }
  return (before - after) / std::max<double>(remainder.cast<double>().squaredNorm(), 1e-300);
}

}  // namespace

void add_periods(const ScanSamples& samples, const Chunks& chunks, Scan& scan) {
  constexpr const char* kAxis[] = {"x", "y", "z"};
  const Pieces pieces = pieces_of(samples);
  if (!(pieces.longest_s > 10)) return;
  const Draws draws = draws_of(samples, pieces, chunks);
  const double step_hz = std::max(0.5 / pieces.longest_s, kFastest_hz / kMostFrequencies);
  Eigen::Vector3d best = Eigen::Vector3d::Zero(), best_hz = best;
  Eigen::VectorXd largest = Eigen::VectorXd::Zero(kDraws);
  for (double hz = 2 / pieces.longest_s; hz <= kFastest_hz; hz += step_hz) {
    const Eigen::Matrix3Xd powers = powers_at(hz, samples, pieces, draws);
    for (int axis = 0; axis < 3; ++axis) {
      if (powers(axis, 0) <= best[axis]) continue;
      best[axis] = powers(axis, 0);
      best_hz[axis] = hz;
    }
    for (int d = 0; d < kDraws; ++d) largest[d] = std::max(largest[d], powers.col(d + 1).maxCoeff());
  }
  const double mean = largest.mean();
  const double accidental = mean + 3 * std::sqrt((largest.array() - mean).square().mean());
  for (int axis = 0; axis < 3; ++axis) {
    if (best[axis] <= accidental) continue;
    const double share = judged_share(best_hz[axis], axis, samples, pieces, chunks, draws[0]);
    if (share < scan.least_share) continue;
    const auto same = std::find_if(scan.entries.begin(), scan.entries.end(), [&](const ScanEntry& entry) {
      return entry.variable == "time" && entry.axis == kAxis[axis];
    });
    ScanEntry entry;
    entry.variable = "time";
    entry.frame = "world";
    entry.axis = kAxis[axis];
    entry.share = entry.uncorrected_share = share;
    entry.share_interval = {std::max(0.0, 2 * share - best[axis]), best[axis]};
    entry.period_s = 1 / best_hz[axis];
    entry.variables = {ScanVariable::kTime};
    entry.column = axis;
    entry.slope = {1, 1, {1, 1}, 0};
    if (same == scan.entries.end())
      scan.entries.push_back(std::move(entry));
    else if (share > same->share)
      *same = std::move(entry);
  }
}

}  // namespace swarmcert::identification
