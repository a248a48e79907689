#include "analysis/identification/clocks/clock_interplay.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <optional>
#include <string>

#include "nn/base/doubles.h"

namespace swarmcert::identification {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using residuals::Track;

constexpr int kFewestSamples = 200;
/// For longer flights only every second, third, ... mean is used.
constexpr std::size_t kMostSamples = 4000;

const Knots kLateral_m = {0, 0.08, 0.2, 0.4, 0.7}, kHeight_m = {-0.8, -0.3, 0, 0.2, 0.4, 0.7, 1.2};

Index map_size() { return static_cast<Index>(kLateral_m.size() * kHeight_m.size()); }

/// Returns the position of a vehicle according to its log; nothing outside the log or in a gap.
std::optional<Vector3d> place_at(const std::vector<double>& times_s, const std::vector<Vector3d>& p_m,
                                 double time_s) {
  constexpr double kLongestGap_s = 0.1;
  const auto after = std::lower_bound(times_s.begin(), times_s.end(), time_s);
  if (after == times_s.begin() || after == times_s.end()) return std::nullopt;
  const auto k = static_cast<std::size_t>(after - times_s.begin());
  const double step_s = times_s[k] - times_s[k - 1];
  if (!(step_s < kLongestGap_s)) return std::nullopt;
  const double share = (time_s - times_s[k - 1]) / step_s;
  return Vector3d(p_m[k - 1] + share * (p_m[k] - p_m[k - 1]));
}

}  // namespace

Interplay::Interplay(const Track& own, const std::vector<Vector3d>& r,
                     const std::vector<const Track*>& others) {
  std::vector<std::string> kinds;
  for (const Track* other : others) {
    Path path;
    for (const stability::Instant& now : other->instants) {
      path.time_s.push_back(now.time_s);
      path.p_m.push_back(now.p_W_m);
    }
    const auto kind = std::find(kinds.begin(), kinds.end(), other->kind);
    path.map = static_cast<int>(kind - kinds.begin());
    if (kind == kinds.end()) kinds.push_back(other->kind);
    others_.push_back(std::move(path));
  }
  maps_ = static_cast<int>(kinds.size());
  read(own, r);
  keep_what_every_shift_knows();
}

bool Interplay::is_rich() const { return size() >= kFewestSamples; }

double Interplay::total() const {
  const auto force_N = Eigen::Map<const VectorXd>(force_N_.data(), size());
  return size() == 0 ? 0 : (force_N.array() - force_N.mean()).square().sum();
}

double Interplay::explained(const std::vector<int>& shifts, int without) {
  if (without < 0) {
    const auto [known, is_new] = of_all_.try_emplace(shifts);
    if (is_new) known->second = fitted_to(sums_at(shifts), -1);
    return known->second;
  }
  const auto [known, is_new] = without_.try_emplace(shifts);
  if (is_new) {
    const std::vector<Sums> tenths = sums_at(shifts);
    for (int t = 0; t < kClockTenths; ++t) known->second[static_cast<std::size_t>(t)] = fitted_to(tenths, t);
  }
  return known->second[static_cast<std::size_t>(without)];
}

void Interplay::read(const Track& own, const std::vector<Vector3d>& r) {
  double sum_N = 0, count = 0, next_s = -kInfinity;
  for (std::size_t i = 0; i < own.instants.size(); ++i) {
    const stability::Instant& now = own.instants[i];
    // Neighbours that are unknown at this reading may be known at the shifted one.
    if (own.cut[i] != residuals::Cut::kNone) continue;
    sum_N += r[i].z();
    ++count;
    if (now.time_s < next_s) continue;
    time_s_.push_back(now.time_s);
    own_m_.push_back(now.p_W_m);
    force_N_.push_back(sum_N / count);
    sum_N = count = 0;
    next_s = now.time_s + kClockSample_s;
  }
}

/// Keeps only samples that are known for each shift, so that all shifts are judged on the same samples.
void Interplay::keep_what_every_shift_knows() {
  const double least_s = -(kClockSteps + kWakeSteps) * kClockStep_s, most_s = kClockSteps * kClockStep_s;
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < time_s_.size(); ++i) {
    const bool is_known = std::all_of(others_.begin(), others_.end(), [&](const Path& other) {
      return place_at(other.time_s, other.p_m, time_s_[i] + least_s) &&
             place_at(other.time_s, other.p_m, time_s_[i] + most_s);
    });
    if (is_known) kept.push_back(i);
  }
  const std::size_t stride = (kept.size() + kMostSamples - 1) / kMostSamples;
  std::size_t count = 0;
  for (std::size_t k = 0; k < kept.size(); k += stride, ++count) {
    time_s_[count] = time_s_[kept[k]];
    own_m_[count] = own_m_[kept[k]];
    force_N_[count] = force_N_[kept[k]];
  }
  time_s_.resize(count);
  own_m_.resize(count);
  force_N_.resize(count);
}

const std::vector<SparseRow>& Interplay::rows_at(Path& path, int shift) const {
  const auto known = path.rows.find(shift);
  if (known != path.rows.end()) return known->second;
  Eigen::VectorXf lateral_m(size()), height_m(size());
  for (Index i = 0; i < size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    // In a gap inside the log the vehicle is treated as far away.
    const Vector3d dp_m = place_at(path.time_s, path.p_m, time_s_[k] + shift * kClockStep_s)
                              .value_or(own_m_[k] + Vector3d(1e3, 0, 0)) -
                          own_m_[k];
    lateral_m(i) = static_cast<float>(dp_m.head<2>().norm());
    height_m(i) = static_cast<float>(dp_m.z());
  }
  return path.rows[shift] = hat_rows(lateral_m, kLateral_m, height_m, kHeight_m);
}

std::vector<Interplay::Sums> Interplay::sums_at(const std::vector<int>& shifts) {
  const Index size_of_all = maps_ * map_size();
  std::vector<Sums> tenths(kClockTenths, {MatrixXd::Zero(size_of_all, size_of_all),
                                          VectorXd::Zero(size_of_all), VectorXd::Zero(size_of_all)});
  std::vector<std::pair<const std::vector<SparseRow>*, Index>> present;  // rows, first column of map
  for (std::size_t j = 0; j < others_.size(); ++j) {
    if (shifts[j] != kAbsent)
      present.emplace_back(&rows_at(others_[j], shifts[j]), others_[j].map * map_size());
  }
  std::vector<std::pair<Index, double>> row;
  for (Index i = 0; i < size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    Sums& sums = tenths[static_cast<std::size_t>(i * kClockTenths / size())];
    row.clear();
    for (const auto& [rows, begin] : present) {
      const SparseRow& one = (*rows)[k];
      for (std::size_t a = 0; a < static_cast<std::size_t>(one.count); ++a)
        row.emplace_back(begin + one.index[a], one.weight[a]);
    }
    for (const auto& [at, weight] : row) {
      sums.b(at) += weight * force_N_[k];
      sums.columns(at) += weight;
      for (const auto& [to, other_weight] : row) sums.gram(to, at) += weight * other_weight;
    }
    sums.sum += force_N_[k];
    ++sums.count;
  }
  return tenths;
}

double Interplay::fitted_to(const std::vector<Sums>& tenths, int without) const {
  const Index size_of_all = maps_ * map_size();
  Sums all = {MatrixXd::Zero(size_of_all, size_of_all), VectorXd::Zero(size_of_all),
              VectorXd::Zero(size_of_all)};
  for (int t = 0; t < kClockTenths; ++t) {
    if (t == without) continue;
    const Sums& one = tenths[static_cast<std::size_t>(t)];
    all.gram += one.gram;
    all.b += one.b;
    all.columns += one.columns;
    all.sum += one.sum;
    all.count += one.count;
  }
  // Hat functions add up to a constant, so a constant force is among the maps. The ridge keeps rare positions at zero.
  all.b -= all.sum / std::max(all.count, 1.0) * all.columns;
  all.gram.diagonal().array() += 1e-2 * all.count / static_cast<double>(map_size());
  return all.b.dot(all.gram.ldlt().solve(all.b));
}

}  // namespace swarmcert::identification
