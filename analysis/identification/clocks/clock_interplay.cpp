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

}  // namespace

ForceRecords force_records(const Track& own, const std::vector<Vector3d>& r, bool everywhere) {
  ForceRecords records;
  double sum_N = 0, count = 0, next_s = -kInfinity;
  for (std::size_t i = 0; i < own.instants.size(); ++i) {
    const stability::Instant& now = own.instants[i];
    const residuals::Cut cut = own.cut[i];
    if (cut != residuals::Cut::kNone && !(everywhere && cut == residuals::Cut::kNeighbour)) continue;
    sum_N += r[i].z();
    ++count;
    if (now.time_s < next_s) continue;
    records.time_s.push_back(now.time_s);
    records.p_m.push_back(now.p_W_m);
    records.force_N.push_back(sum_N / count);
    sum_N = count = 0;
    next_s = now.time_s + kClockSample_s;
  }
  return records;
}

LoggedPath::LoggedPath(const Track& track) {
  for (const stability::Instant& now : track.instants) {
    time_s.push_back(now.time_s);
    p_m.push_back(now.p_W_m);
  }
}

std::optional<Vector3d> LoggedPath::at(double when_s) const {
  constexpr double kLongestGap_s = 0.1;
  const auto after = std::lower_bound(time_s.begin(), time_s.end(), when_s);
  if (after == time_s.begin() || after == time_s.end()) return std::nullopt;
  const auto k = static_cast<std::size_t>(after - time_s.begin());
  const double step_s = time_s[k] - time_s[k - 1];
  if (!(step_s < kLongestGap_s)) return std::nullopt;
  const double share = (when_s - time_s[k - 1]) / step_s;
  return Vector3d(p_m[k - 1] + share * (p_m[k] - p_m[k - 1]));
}

Index interplay_columns() { return static_cast<Index>(kLateral_m.size() * kHeight_m.size()); }

std::vector<SparseRow> interplay_rows(const Eigen::VectorXf& lateral_m, const Eigen::VectorXf& height_m) {
  return hat_rows(lateral_m, kLateral_m, height_m, kHeight_m);
}

void InterplaySums::add(const std::vector<std::pair<Index, double>>& row, double force_N) {
  for (const auto& [at, weight] : row) {
    b(at) += weight * force_N;
    columns(at) += weight;
    for (const auto& [to, other_weight] : row) gram(to, at) += weight * other_weight;
  }
  sum += force_N;
  ++count;
}

InterplaySums& InterplaySums::operator+=(const InterplaySums& other) {
  gram += other.gram;
  b += other.b;
  columns += other.columns;
  sum += other.sum;
  count += other.count;
  return *this;
}

double InterplaySums::explained() const {
  // Hat functions add up to a constant, so a constant force is among the maps. The ridge keeps rare positions at zero.
  const VectorXd centred = b - sum / std::max(count, 1.0) * columns;
  MatrixXd firm = gram;
  firm.diagonal().array() += 1e-2 * count / static_cast<double>(interplay_columns());
  return centred.dot(firm.ldlt().solve(centred));
}

Interplay::Interplay(const Track& own, const std::vector<Vector3d>& r,
                     const std::vector<const Track*>& others) {
  std::vector<std::string> kinds;
  for (const Track* other : others) {
    Path path = {LoggedPath(*other), 0, {}};
    const auto kind = std::find(kinds.begin(), kinds.end(), other->kind);
    path.map = static_cast<int>(kind - kinds.begin());
    if (kind == kinds.end()) kinds.push_back(other->kind);
    others_.push_back(std::move(path));
  }
  maps_ = static_cast<int>(kinds.size());
  records_ = force_records(own, r, false);
  keep_what_every_shift_knows();
}

bool Interplay::is_rich() const { return size() >= kFewestSamples; }

double Interplay::total() const {
  const auto force_N = Eigen::Map<const VectorXd>(records_.force_N.data(), size());
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
    const std::vector<InterplaySums> tenths = sums_at(shifts);
    for (int t = 0; t < kClockTenths; ++t) known->second[static_cast<std::size_t>(t)] = fitted_to(tenths, t);
  }
  return known->second[static_cast<std::size_t>(without)];
}

/// Keeps only samples that are known for each shift, so that all shifts are judged on the same samples.
void Interplay::keep_what_every_shift_knows() {
  const double least_s = -(kClockSteps + kWakeSteps) * kClockStep_s, most_s = kClockSteps * kClockStep_s;
  auto& [time_s, force_N, own_m] = records_;
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < time_s.size(); ++i) {
    const bool is_known = std::all_of(others_.begin(), others_.end(), [&](const Path& other) {
      return other.logged.at(time_s[i] + least_s) && other.logged.at(time_s[i] + most_s);
    });
    if (is_known) kept.push_back(i);
  }
  const std::size_t stride = (kept.size() + kMostSamples - 1) / kMostSamples;
  std::size_t count = 0;
  for (std::size_t k = 0; k < kept.size(); k += stride, ++count) {
    time_s[count] = time_s[kept[k]];
    own_m[count] = own_m[kept[k]];
    force_N[count] = force_N[kept[k]];
  }
  time_s.resize(count);
  own_m.resize(count);
  force_N.resize(count);
}

const std::vector<SparseRow>& Interplay::rows_at(Path& path, int shift) const {
  const auto known = path.rows.find(shift);
  if (known != path.rows.end()) return known->second;
  Eigen::VectorXf lateral_m(size()), height_m(size());
  for (Index i = 0; i < size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    // In a gap inside the log the vehicle is treated as far away.
    const Vector3d& own_m = records_.p_m[k];
    const Vector3d dp_m =
        path.logged.at(records_.time_s[k] + shift * kClockStep_s).value_or(own_m + Vector3d(1e3, 0, 0)) -
        own_m;
    lateral_m(i) = static_cast<float>(dp_m.head<2>().norm());
    height_m(i) = static_cast<float>(dp_m.z());
  }
  return path.rows[shift] = interplay_rows(lateral_m, height_m);
}

std::vector<InterplaySums> Interplay::sums_at(const std::vector<int>& shifts) {
  std::vector<InterplaySums> tenths(kClockTenths, InterplaySums(maps_ * interplay_columns()));
  std::vector<std::pair<const std::vector<SparseRow>*, Index>> present;  // rows, first column of map
  for (std::size_t j = 0; j < others_.size(); ++j) {
    if (shifts[j] != kAbsent)
      present.emplace_back(&rows_at(others_[j], shifts[j]), others_[j].map * interplay_columns());
  }
  std::vector<std::pair<Index, double>> row;
  for (Index i = 0; i < size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    row.clear();
    for (const auto& [rows, begin] : present) {
      const SparseRow& one = (*rows)[k];
      for (std::size_t a = 0; a < static_cast<std::size_t>(one.count); ++a)
        row.emplace_back(begin + one.index[a], one.weight[a]);
    }
    tenths[static_cast<std::size_t>(i * kClockTenths / size())].add(row, records_.force_N[k]);
  }
  return tenths;
}

double Interplay::fitted_to(const std::vector<InterplaySums>& tenths, int without) const {
  InterplaySums all(maps_ * interplay_columns());
  for (int t = 0; t < kClockTenths; ++t) {
    if (t != without) all += tenths[static_cast<std::size_t>(t)];
  }
  return all.explained();
}

}  // namespace swarmcert::identification
