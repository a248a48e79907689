#include "analysis/identification/clock_offset.h"

#include <fmt/core.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <optional>

#include "analysis/identification/scan/curve_fit.h"
#include "analysis/residuals/force_residual.h"
#include "nn/base/doubles.h"
#include "nn/base/parallel.h"

namespace swarmcert::identification {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using residuals::Track;

constexpr double kShiftStep_s = 0.02;
constexpr int kOffsets = 20;                         ///< steps to each side of zero
constexpr int kDelays = 15;                          ///< steps from zero on
constexpr int kShifts = 2 * kOffsets + kDelays + 1;  ///< from -kOffsets - kDelays to kOffsets
constexpr int kTenths = 10;
constexpr int kFewestSamples = 200;
/// Of the variance of a vehicle's vertical force that its neighbour has to explain.
constexpr double kLeastInterplay = 0.1;
/// Of what is explained, that the offset has to add.
constexpr double kLeastGain = 0.05;
constexpr double kLeastZ = 3;
constexpr double kStudent90 = 1.833;  ///< nine degrees of freedom

const Knots kLateral_m = {0, 0.08, 0.2, 0.4, 0.7}, kHeight_m = {-0.8, -0.3, 0, 0.2, 0.4, 0.7, 1.2};

/// Sums of a least-squares fit over a tenth of the flight.
struct Sums {
  MatrixXd gram;
  VectorXd b;
  double squares = 0, sum = 0, count = 0;
};

/// The vertical force on one vehicle beside the place of the other, for all shifts of the other's clock.
class Interplay {
 public:
  /// @param r force_residual(), in W.
  Interplay(const Track& track, const std::vector<Vector3d>& r) {
    read(track, r);
    if (size() < kFewestSamples) return;
    const Index columns = static_cast<Index>(kLateral_m.size() * kHeight_m.size());
    sums_.assign(kShifts,
                 std::vector<Sums>(kTenths, {MatrixXd::Zero(columns, columns), VectorXd::Zero(columns)}));
    for (int shift = 0; shift < kShifts; ++shift) add_shift(shift);
  }

  int size() const { return static_cast<int>(force_N_.size()); }
  bool is_rich() const { return !sums_.empty(); }

  /// Sum of squares about the mean without one tenth (-1: none left out).
  double total(int without) const {
    const Sums all = added(0, without);
    return all.squares - all.sum * all.sum / std::max(all.count, 1.0);
  }
  /// What the map explains of it at a shift.
  double explained(int shift, int without) const {
    Sums all = added(shift, without);
    const double mean = all.sum / std::max(all.count, 1.0);
    // Hats add up to one: a constant force is among the maps. The ridge keeps places that were hardly visited at zero.
    all.b -= mean * all.gram.rowwise().sum();
    all.gram.diagonal().array() += 1e-2 * all.count / static_cast<double>(all.b.size());
    return all.b.dot(all.gram.ldlt().solve(all.b));
  }

 private:
  void read(const Track& track, const std::vector<Vector3d>& r) {
    double sum_N = 0, count = 0, next_s = -kInfinity;
    for (std::size_t i = 0; i < track.instants.size(); ++i) {
      const stability::Instant& now = track.instants[i];
      if (now.num_neighbours == 1) {
        other_s_.push_back(now.time_s);
        other_m_.push_back(now.p_W_m + now.neighbours[0].dp_W_m);
      }
      if (track.cut[i] != residuals::Cut::kNone) continue;
      sum_N += r[i].z();
      ++count;
      if (now.time_s < next_s) continue;
      time_s_.push_back(now.time_s);
      own_m_.push_back(now.p_W_m);
      force_N_.push_back(sum_N / count);
      sum_N = count = 0;
      next_s = now.time_s + kClockSample_s;
    }
    keep_what_every_shift_knows();
  }

  /// Where the other log has its vehicle; nothing outside of it or in a gap.
  std::optional<Vector3d> other_at(double time_s) const {
    constexpr double kLongestGap_s = 0.1;
    const auto after = std::lower_bound(other_s_.begin(), other_s_.end(), time_s);
    if (after == other_s_.begin() || after == other_s_.end()) return std::nullopt;
    const auto k = static_cast<std::size_t>(after - other_s_.begin());
    const double step_s = other_s_[k] - other_s_[k - 1];
    if (!(step_s < kLongestGap_s)) return std::nullopt;
    const double share = (time_s - other_s_[k - 1]) / step_s;
    return Vector3d(other_m_[k - 1] + share * (other_m_[k] - other_m_[k - 1]));
  }

  static double shift_s(int shift) { return (shift - kOffsets - kDelays) * kShiftStep_s; }

  /// All shifts are judged on the same samples.
  void keep_what_every_shift_knows() {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < time_s_.size(); ++i) {
      if (!other_at(time_s_[i] + shift_s(0)) || !other_at(time_s_[i] + shift_s(kShifts - 1))) continue;
      time_s_[kept] = time_s_[i];
      own_m_[kept] = own_m_[i];
      force_N_[kept++] = force_N_[i];
    }
    time_s_.resize(kept);
    own_m_.resize(kept);
    force_N_.resize(kept);
  }

  void add_shift(int shift) {
    const auto n = static_cast<Index>(time_s_.size());
    Eigen::VectorXf lateral_m(n), height_m(n);
    for (Index i = 0; i < n; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const std::optional<Vector3d> other = other_at(time_s_[k] + shift_s(shift));
      const Vector3d dp_m = other.value_or(own_m_[k] + Vector3d(1e3, 0, 0)) - own_m_[k];
      lateral_m(i) = static_cast<float>(dp_m.head<2>().norm());
      height_m(i) = static_cast<float>(dp_m.z());
    }
    const std::vector<SparseRow> rows = hat_rows(lateral_m, kLateral_m, height_m, kHeight_m);
    for (Index i = 0; i < n; ++i) {
      Sums& sums = sums_[static_cast<std::size_t>(shift)][static_cast<std::size_t>(i * kTenths / n)];
      const SparseRow& row = rows[static_cast<std::size_t>(i)];
      const double force_N = force_N_[static_cast<std::size_t>(i)];
      for (int a = 0; a < row.count; ++a) {
        const auto at = static_cast<std::size_t>(a);
        sums.b(row.index[at]) += row.weight[at] * force_N;
        for (int c = 0; c < row.count; ++c) {
          const auto to = static_cast<std::size_t>(c);
          sums.gram(row.index[at], row.index[to]) += row.weight[at] * row.weight[to];
        }
      }
      sums.squares += force_N * force_N;
      sums.sum += force_N;
      ++sums.count;
    }
  }

  Sums added(int shift, int without) const {
    const std::vector<Sums>& tenths = sums_[static_cast<std::size_t>(shift)];
    Sums all = {MatrixXd::Zero(tenths[0].gram.rows(), tenths[0].gram.cols()),
                VectorXd::Zero(tenths[0].b.size())};
    for (int t = 0; t < kTenths; ++t) {
      if (t == without) continue;
      const Sums& one = tenths[static_cast<std::size_t>(t)];
      all.gram += one.gram;
      all.b += one.b;
      all.squares += one.squares;
      all.sum += one.sum;
      all.count += one.count;
    }
    return all;
  }

  std::vector<double> time_s_, force_N_, other_s_;
  std::vector<Vector3d> own_m_, other_m_;
  std::vector<std::vector<Sums>> sums_;  ///< [shift][tenth]
};

/// What both explain together, by offset and delay.
class Together {
 public:
  Together(const Interplay& first, const Interplay& second, int without) {
    for (int shift = 0; shift < kShifts; ++shift) {
      first_.push_back(first.explained(shift, without));
      second_.push_back(second.explained(shift, without));
    }
    for (int o = -kOffsets; o <= kOffsets; ++o) {
      profile_.push_back(-kInfinity);
      delay_.push_back(0);
      for (int tau = 0; tau <= kDelays; ++tau) {
        const double value = at(first_, o - tau) + at(second_, -o - tau);
        if (value > profile_.back()) profile_.back() = value, delay_.back() = tau;
      }
    }
    best_ = static_cast<int>(std::max_element(profile_.begin(), profile_.end()) - profile_.begin());
  }

  /// The top of the parabola through the best step and its neighbours.
  double offset_s() const {
    double steps = best_ - kOffsets;
    if (!is_at_end()) {
      const double left = value(best_ - 1), middle = value(best_), right = value(best_ + 1);
      const double bend = left - 2 * middle + right;
      if (bend < 0) steps += 0.5 * (left - right) / bend;
    }
    return steps * kShiftStep_s;
  }
  bool is_at_end() const { return best_ == 0 || best_ == 2 * kOffsets; }
  double delay_s() const { return delay_[static_cast<std::size_t>(best_)] * kShiftStep_s; }
  double largest() const { return value(best_); }
  double without_offset() const { return value(kOffsets); }
  double of_first() const { return at(first_, best_ - kOffsets - steps_of_delay()); }
  double of_second() const { return at(second_, kOffsets - best_ - steps_of_delay()); }

 private:
  static double at(const std::vector<double>& of, int steps) {
    return of[static_cast<std::size_t>(steps + kOffsets + kDelays)];
  }
  double value(int k) const { return profile_[static_cast<std::size_t>(k)]; }
  int steps_of_delay() const { return delay_[static_cast<std::size_t>(best_)]; }

  std::vector<double> first_, second_, profile_;
  std::vector<int> delay_;
  int best_ = 0;
};

std::optional<ClockOffset> offset_of(const Interplay& first, const Interplay& second) {
  if (!first.is_rich() || !second.is_rich()) return std::nullopt;
  const Together all(first, second, -1);
  const bool both = all.of_first() > kLeastInterplay * first.total(-1) &&
                    all.of_second() > kLeastInterplay * second.total(-1);
  if (!both || all.is_at_end() || all.largest() - all.without_offset() < kLeastGain * all.largest())
    return std::nullopt;
  std::array<double, kTenths> left_out{};
  double mean = 0, variance = 0;
  for (int t = 0; t < kTenths; ++t)
    mean += (left_out[static_cast<std::size_t>(t)] = Together(first, second, t).offset_s()) / kTenths;
  for (const double offset_s : left_out)
    variance += (offset_s - mean) * (offset_s - mean) * (kTenths - 1) / kTenths;
  // Offsets between the steps of the grid are read off a parabola.
  const double deviation_s = std::hypot(std::sqrt(variance), kShiftStep_s / 4);
  ClockOffset result;
  result.offset_s = all.offset_s();
  result.interval = {result.offset_s - kStudent90 * deviation_s, result.offset_s + kStudent90 * deviation_s};
  result.delay_s = all.delay_s();
  result.records = first.size() + second.size();
  result.z = std::abs(result.offset_s) / deviation_s;
  const double squares = first.total(-1) + second.total(-1), n = result.records;
  result.rmse_before_N = std::sqrt(std::max(0.0, squares - all.without_offset()) / n);
  result.rmse_after_N = std::sqrt(std::max(0.0, squares - all.largest()) / n);
  if (!(result.z > kLeastZ)) return std::nullopt;
  return result;
}

/// Two vehicles whose forces are judged, and whose clocks nothing relates.
bool is_unrelated_pair(const std::vector<Track>& tracks) {
  return tracks.size() == 2 && !tracks[0].position_only && !tracks[1].position_only &&
         !tracks[1].has_absolute_clock && tracks[1].clock_onsets == 0 && tracks[0].judged.z() == 1 &&
         tracks[1].judged.z() == 1;
}

}  // namespace

std::vector<ClockOffset> clock_offsets(const residuals::Inputs& inputs, int jobs) {
  const std::size_t count = inputs.found.flights.size();
  std::vector<std::optional<ClockOffset>> found(count);
  files::parallel_for(static_cast<int>(count), jobs, [&](int index) {
    const auto i = static_cast<std::size_t>(index);
    if (inputs.found.flights[i].logs.size() != 2) return;
    std::vector<std::string> problems;  // the diagnosis tells them
    const std::vector<Track> tracks = inputs.load(i, problems);
    if (!is_unrelated_pair(tracks)) return;
    const auto interplay = [&](const Track& track) {
      return Interplay(track, force_residual(inputs.model_for(track), inputs.kinds, inputs.rules, track));
    };
    found[i] = offset_of(interplay(tracks[0]), interplay(tracks[1]));
    if (!found[i]) return;
    found[i]->flight = tracks[1].flight;
    found[i]->vehicle = tracks[1].vehicle;
    found[i]->kind = tracks[1].kind;
    found[i]->path = tracks[1].path;
  });
  std::vector<ClockOffset> result;
  for (std::optional<ClockOffset>& one : found)
    if (one) result.push_back(std::move(*one));
  return result;
}

void correct_clocks(const std::vector<ClockOffset>& offsets, residuals::Inputs& inputs) {
  for (const ClockOffset& offset : offsets) {
    for (residuals::FlightFiles& flight : inputs.found.flights) {
      const bool has_log = std::any_of(flight.logs.begin(), flight.logs.end(),
                                       [&](const auto& log) { return log.second == offset.path; });
      if (has_log) flight.clock_offsets_s[offset.path] = offset.offset_s;
    }
  }
}

std::string in_words(const ClockOffset& offset) {
  return fmt::format("the clock of {} is {:.3f} s {} that of the other log ({:+.3f} .. {:+.3f})",
                     std::filesystem::path(offset.path).filename().string(), std::abs(offset.offset_s),
                     offset.offset_s > 0 ? "ahead of" : "behind", offset.interval.lower,
                     offset.interval.upper);
}

}  // namespace swarmcert::identification
