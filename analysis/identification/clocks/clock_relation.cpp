#include "analysis/identification/clocks/clock_relation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "nn/base/doubles.h"
#include "nn/base/median.h"

namespace swarmcert::identification {
namespace {

using Eigen::Index;
using residuals::Track;

constexpr double kNoRatio = std::numeric_limits<double>::quiet_NaN();
constexpr double kLatticeStep_s = 2 * kClockStep_s;
constexpr int kLatticeDelays = kWakeSteps / 2;  ///< largest delay of a wake, in steps
constexpr double kApart_s = 1;                  ///< least distance between a peak and its rivals
constexpr std::size_t kMostLatticeRecords = 1000;
constexpr int kFewestLatticeRecords = 200;
constexpr std::size_t kFewestRivals = 12;

/// The maps of one vehicle as functions of the shift of some of the others.
class ShiftedMaps {
 public:
  explicit ShiftedMaps(const ClockedVehicle& own) : own_(own) {
    const ForceRecords all = force_records(*own.track, *own.r, true);
    const auto count = static_cast<std::size_t>(all.size());
    const std::size_t stride =
        std::max<std::size_t>(1, (count + kMostLatticeRecords - 1) / kMostLatticeRecords);
    for (std::size_t i = 0; i < count; i += stride) {
      records_.time_s.push_back(all.time_s[i]);
      records_.p_m.push_back(all.p_m[i]);
      records_.force_N.push_back(all.force_N[i]);
    }
  }

  /// @param moves its position is read at the time of ratio_at(); else at that of this vehicle minus `delay_s`
  void add(const ClockedVehicle& other, bool moves, double delay_s) {
    const auto kind = std::find(kinds_.begin(), kinds_.end(), other.track->kind);
    const Index map = static_cast<Index>(kind - kinds_.begin());
    if (kind == kinds_.end()) kinds_.push_back(other.track->kind);
    others_.push_back({LoggedPath(*other.track), map, other.ahead_s - own_.ahead_s, {}});
    if (moves) return;
    others_.back().fixed = rows_of(others_.back(), -delay_s);
  }

  int size() const { return records_.size(); }

  /// Returns n/2 times the log likelihood ratio; not a number if fewer than `fewest` records know the moved vehicles.
  double ratio_at(double shift_s, int fewest) const {
    std::vector<std::vector<SparseRow>> moved(others_.size());
    for (std::size_t j = 0; j < others_.size(); ++j)
      if (others_[j].fixed.empty()) moved[j] = rows_of(others_[j], shift_s);
    InterplaySums sums(static_cast<Index>(kinds_.size()) * interplay_columns());
    double squares_N2 = 0;
    std::vector<std::pair<Index, double>> row;
    for (std::size_t k = 0; k < records_.force_N.size(); ++k) {
      row.clear();
      bool is_known = true;
      for (std::size_t j = 0; j < others_.size(); ++j) {
        const bool moves = others_[j].fixed.empty();
        const SparseRow& one = moves ? moved[j][k] : others_[j].fixed[k];
        is_known = is_known && (!moves || one.count > 0);
        for (std::size_t a = 0; a < static_cast<std::size_t>(one.count); ++a)
          row.emplace_back(others_[j].map * interplay_columns() + one.index[a], one.weight[a]);
      }
      if (!is_known) continue;
      sums.add(row, records_.force_N[k]);
      squares_N2 += records_.force_N[k] * records_.force_N[k];
    }
    if (sums.count < fewest) return kNoRatio;
    const double total_N2 = squares_N2 - sums.sum * sums.sum / sums.count;
    if (!(total_N2 > 0)) return 0;
    return -sums.count / 2 * std::log(std::max(1 - sums.explained() / total_N2, 1e-12));
  }

 private:
  struct Other {
    LoggedPath path;
    Index map = 0;
    double ahead_s = 0;
    std::vector<SparseRow> fixed;  ///< empty: it moves
  };

  /// Rows are empty where the position is unknown.
  std::vector<SparseRow> rows_of(const Other& other, double shift_s) const {
    Eigen::VectorXf lateral_m(size()), height_m(size());
    for (Index i = 0; i < size(); ++i) {
      const auto k = static_cast<std::size_t>(i);
      const auto place_m = other.path.at(records_.time_s[k] + other.ahead_s + shift_s);
      lateral_m(i) = height_m(i) = std::numeric_limits<float>::quiet_NaN();
      if (!place_m) continue;
      const Eigen::Vector3d dp_m = *place_m - records_.p_m[k];
      lateral_m(i) = static_cast<float>(dp_m.head<2>().norm());
      height_m(i) = static_cast<float>(dp_m.z());
    }
    return interplay_rows(lateral_m, height_m);
  }

  const ClockedVehicle own_;
  ForceRecords records_;
  std::vector<Other> others_;
  std::vector<std::string> kinds_;
};

/// Offsets of a clock, in steps of the lattice.
struct Offsets {
  int least = 0, most = 0;
};

/// Returns the offsets of `clock` at which its logs overlap any of the others.
Offsets overlapping(const std::vector<ClockedVehicle>& vehicles, int clock) {
  double least_s = kInfinity, most_s = -kInfinity;
  for (const ClockedVehicle& own : vehicles) {
    for (const ClockedVehicle& other : vehicles) {
      if (own.clock != clock || other.clock == clock) continue;
      const auto &mine = own.track->instants, &its = other.track->instants;
      if (mine.empty() || its.empty()) continue;
      least_s = std::min(least_s, mine.front().time_s - its.back().time_s + other.ahead_s);
      most_s = std::max(most_s, mine.back().time_s - its.front().time_s + other.ahead_s);
    }
  }
  if (!(least_s < most_s)) return {};
  return {static_cast<int>(std::floor(least_s / kLatticeStep_s)),
          static_cast<int>(std::ceil(most_s / kLatticeStep_s))};
}

/// Returns the ratios of one vehicle at each offset of `clock` and each delay, [offset][delay].
std::vector<std::vector<double>> ratios_of(const std::vector<ClockedVehicle>& vehicles, std::size_t own,
                                           int clock, double delay_s, const Offsets& offsets) {
  const bool is_shifted = vehicles[own].clock == clock;
  ClockedVehicle still = vehicles[own];
  if (is_shifted) still.ahead_s = 0;
  ShiftedMaps maps(still);
  for (std::size_t j = 0; j < vehicles.size(); ++j) {
    if (j == own) continue;
    ClockedVehicle other = vehicles[j];
    if (other.clock == clock) other.ahead_s = 0;
    maps.add(other, is_shifted != (other.clock == clock), delay_s);
  }
  const int fewest = std::max(kFewestLatticeRecords, maps.size() / 2);
  // The other's position is read at the vehicle's time plus o - t, or plus -o - t if the vehicle itself is shifted.
  const int first = (is_shifted ? -offsets.most : offsets.least) - kLatticeDelays;
  const int last = is_shifted ? -offsets.least : offsets.most;
  std::vector<double> at;
  for (int shift = first; shift <= last; ++shift) at.push_back(maps.ratio_at(shift * kLatticeStep_s, fewest));
  std::vector<std::vector<double>> ratios;
  for (int o = offsets.least; o <= offsets.most; ++o) {
    ratios.emplace_back();
    for (int delay = 0; delay <= kLatticeDelays; ++delay)
      ratios.back().push_back(at[static_cast<std::size_t>((is_shifted ? -o : o) - delay - first)]);
  }
  return ratios;
}

}  // namespace

double chance_of_peak(const std::vector<double>& values, std::size_t narrowest) {
  std::vector<double> finite;
  for (const double value : values)
    if (std::isfinite(value)) finite.push_back(value);
  if (finite.empty()) return 1;
  const double median = upper_median(finite), most = *std::max_element(finite.begin(), finite.end());
  const auto top = static_cast<std::size_t>(std::find(values.begin(), values.end(), most) - values.begin());
  std::size_t first = top, last = top;
  const auto is_hill = [&](std::size_t i) { return values[i] > (most + median) / 2; };
  while (first > 0 && is_hill(first - 1)) --first;
  while (last + 1 < values.size() && is_hill(last + 1)) ++last;
  const std::size_t apart = std::max(narrowest, last - first + 1);
  std::vector<double> rivals;
  const auto add_rivals = [&](std::size_t begin, std::size_t end) {
    for (; begin + apart <= end; begin += apart) {
      double largest = -kInfinity;
      for (std::size_t i = begin; i < begin + apart; ++i)
        if (std::isfinite(values[i])) largest = std::max(largest, values[i]);
      if (std::isfinite(largest)) rivals.push_back(largest);
    }
  };
  if (first > apart) add_rivals((first - apart) % apart, first - apart);
  add_rivals(last + 1 + apart, values.size());
  if (rivals.size() < kFewestRivals) return 1;
  std::sort(rivals.begin(), rivals.end());
  // The mean excess over a threshold is the scale of an exponential tail.
  const std::size_t half = rivals.size() / 2;
  double scale = 0;
  for (std::size_t i = half; i < rivals.size(); ++i)
    scale += (rivals[i] - rivals[half - 1]) / static_cast<double>(rivals.size() - half);
  return scale > 0 ? std::exp(-std::max(0.0, most - rivals.back()) / scale) : 1;
}

ClockPeak clock_peak(const std::vector<ClockedVehicle>& vehicles, int clock, double delay_s) {
  const Offsets offsets = overlapping(vehicles, clock);
  if (offsets.least == offsets.most) return {};
  const auto count = static_cast<std::size_t>(offsets.most - offsets.least + 1);
  std::vector<std::vector<double>> sums(count, std::vector<double>(kLatticeDelays + 1, 0));
  for (std::size_t own = 0; own < vehicles.size(); ++own) {
    const auto ratios = ratios_of(vehicles, own, clock, delay_s, offsets);
    for (std::size_t o = 0; o < count; ++o)
      for (std::size_t delay = 0; delay < sums[o].size(); ++delay) sums[o][delay] += ratios[o][delay];
  }
  std::vector<double> values;
  ClockPeak peak;
  double largest = -kInfinity;
  for (std::size_t o = 0; o < count; ++o) {
    double best = kNoRatio;
    for (const double sum : sums[o])
      if (std::isfinite(sum) && !(sum <= best)) best = sum;
    values.push_back(best);
    if (!(best > largest)) continue;
    largest = best;
    peak.ahead_s = (offsets.least + static_cast<int>(o)) * kLatticeStep_s;
  }
  peak.chance = chance_of_peak(values, static_cast<std::size_t>(std::lround(kApart_s / kLatticeStep_s)));
  return peak;
}

}  // namespace swarmcert::identification
