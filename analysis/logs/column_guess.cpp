#include "analysis/logs/column_guess.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "analysis/logs/angles.h"
#include "analysis/logs/statistics_of_series.h"

namespace swarmcert::logs {
namespace {

using Numbers = std::vector<double>;

double mean_of(const Numbers& values) {
  double sum = 0;
  std::size_t count = 0;
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    sum += value;
    ++count;
  }
  return count == 0 ? std::nan("") : sum / static_cast<double>(count);
}

/// Returns the slope of `values` over about `span_s` around each record.
Numbers slope_of(const Numbers& time_s, const Numbers& values, double span_s) {
  const std::size_t n = values.size();
  Numbers slope(n, std::nan(""));
  std::size_t from = 0, to = 0;
  for (std::size_t i = 0; i < n; ++i) {
    while (from + 1 < i && time_s[from] < time_s[i] - span_s / 2) ++from;
    to = std::max(to, i);
    while (to + 1 < n && time_s[to] < time_s[i] + span_s / 2) ++to;
    if (time_s[to] > time_s[from]) slope[i] = (values[to] - values[from]) / (time_s[to] - time_s[from]);
  }
  return slope;
}

/// Returns the factor among `units` closest to `size` if it is within 30 %; nullptr otherwise.
struct UnitSize {
  const char* name;
  double per_si;
};
const UnitSize* unit_near(const std::vector<UnitSize>& units, double size) {
  for (const UnitSize& unit : units) {
    if (size * unit.per_si > 0 && std::abs(size / unit.per_si - 1) < 0.3) return &unit;
  }
  return nullptr;
}

class Guesser {
 public:
  Guesser(const RawTopic& topic, std::vector<char> taken, const std::vector<std::string>& known)
      : topic_(topic), taken_(std::move(taken)), known_(known) {
    for (std::size_t c = 0; c < topic.columns.size(); ++c) {
      const Numbers& values = topic.columns[c].values;
      const double low = quantile_of(values, 0), high = quantile_of(values, 1);
      if (taken_[c] != 0)
        taken_[c] = kTaken;
      else if (!(high > low))
        taken_[c] = kConstant;
      slopes_.push_back(taken_[c] != 0 ? Numbers() : slope_of(topic.time_s, values, kSlope_s));
    }
  }

  std::vector<ColumnGuess> guesses() {
    if (wants("attitude_w")) quaternion();
    if (wants("position_x") && wants("velocity_x")) motion();
    if (wants("attitude_w") && !has_quaternion_ && wants("roll")) angles();
    if (wants("rate_x")) rates();
    if (wants("specific_force_x")) specific_force();
    if (wants("duty_1") && wants("requested_1")) motors();
    if (wants("battery")) battery();
    return std::move(found_);
  }

 private:
  static constexpr double kSlope_s = 0.05;
  static constexpr char kConstant = 1;  ///< constant or without numbers: carries no information
  static constexpr char kTaken = 2;

  bool wants(const std::string& signal) const {
    return std::find(known_.begin(), known_.end(), signal) == known_.end();
  }
  const Numbers& values(std::size_t c) const { return topic_.columns[c].values; }
  std::size_t size() const { return topic_.columns.size(); }
  /// Returns true if the `count` columns starting at `first` are not claimed yet.
  bool free(std::size_t first, std::size_t count) const {
    if (first + count > size()) return false;
    return std::all_of(taken_.begin() + static_cast<std::ptrdiff_t>(first),
                       taken_.begin() + static_cast<std::ptrdiff_t>(first + count),
                       [](char taken) { return taken == 0; });
  }
  void claim(const std::string& signal, std::size_t column, const char* unit, const char* frame,
             const std::string& evidence) {
    taken_[column] = kTaken;
    found_.push_back({signal, column, unit, frame, evidence});
  }
  void claim_axes(const std::string& signal, std::size_t first, const char* unit, const char* frame,
                  const std::string& evidence) {
    for (std::size_t k = 0; k < 3; ++k) claim(signal + "_" + "xyz"[k], first + k, unit, frame, evidence);
  }

  /// Returns, per record, the square root of the sum of squares of `count` columns.
  Numbers norm(std::size_t first, std::size_t count) const {
    Numbers norms(topic_.time_s.size(), 0);
    for (std::size_t c = first; c < first + count; ++c)
      for (std::size_t i = 0; i < norms.size(); ++i) norms[i] += values(c)[i] * values(c)[i];
    for (double& value : norms) value = std::sqrt(value);
    return norms;
  }

  void quaternion() {
    for (std::size_t c = 0; c + 4 <= size(); ++c) {
      // A constant component does not rule out a quaternion: a vehicle may hold its yaw.
      const bool has_numbers = std::all_of(taken_.begin() + static_cast<std::ptrdiff_t>(c),
                                           taken_.begin() + static_cast<std::ptrdiff_t>(c + 4),
                                           [](char taken) { return taken != kTaken; });
      const Numbers norms = norm(c, 4);
      if (!has_numbers || !(quantile_of(norms, 0.02) > 0.98) || !(quantile_of(norms, 0.98) < 1.02)) continue;
      const auto size_of = [this](std::size_t column) {
        Numbers sizes = values(column);
        for (double& value : sizes) value = std::abs(value);
        return mean_of(sizes);
      };
      const bool w_first = size_of(c) > size_of(c + 3);
      const std::array<const char*, 4> names = w_first ? std::array<const char*, 4>{"w", "x", "y", "z"}
                                                       : std::array<const char*, 4>{"x", "y", "z", "w"};
      for (std::size_t k = 0; k < 4; ++k)
        claim(std::string("attitude_") + names[k], c + k, "1", nullptr,
              w_first ? "unit norm; the first is the largest" : "unit norm; the last is the largest");
      has_quaternion_ = true;
      const std::size_t w = w_first ? c : c + 3, x = w_first ? c + 1 : c;
      quaternion_ = {x, x + 1, x + 2, w};
      return;
    }
  }

  /// Slope of the lateral acceleration over the one predicted from the thrust axis of quaternion_, times the unit; 0
  /// without a quaternion.
  double tilt_correlation(std::size_t velocity) const {
    if (!has_quaternion_) return 0;
    const Numbers acceleration = slope_of(topic_.time_s, values(velocity), 0.1);
    Numbers tilt;
    for (std::size_t i = 0; i < topic_.time_s.size(); ++i) {
      const auto q = [&](std::size_t k) { return values(quaternion_[k])[i]; };
      tilt.push_back(2 * (q(0) * q(2) + q(1) * q(3)));
    }
    return line_through(tilt, acceleration).correlation;
  }

  void motion() {
    struct Pair {
      std::size_t position, velocity;
      double correlation, factor, tilt;
    };
    std::vector<Pair> pairs;
    for (std::size_t p = 0; p + 3 <= size(); ++p) {
      if (!free(p, 3)) continue;
      for (std::size_t v = 0; v + 3 <= size(); ++v) {
        if (!free(v, 3) || (v < p + 3 && p < v + 3)) continue;
        double least = 1, factor = 0;
        for (std::size_t k = 0; k < 3; ++k) {
          const Line line = line_through(values(v + k), slopes_[p + k]);
          if (!(line.correlation > 0.8)) least = 0;
          if (least == 0) break;
          least = std::min(least, line.correlation);
          factor += line.slope / 3;
        }
        if (least > 0) pairs.push_back({p, v, least, factor, tilt_correlation(v)});
      }
    }
    if (pairs.empty()) return;
    const Pair& best = *std::max_element(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) {
      return a.tilt + a.correlation < b.tilt + b.correlation;
    });
    // Rooms are a few metres wide, and indoor flights reach a few metres per second.
    const bool mm = quantile_of(norm(best.velocity, 3), 0.95) > 60;
    const bool position_mm = mm ? best.factor > 0.03 : best.factor > 30;
    const std::string evidence = fmt::format("its derivative is {}, correlation {:.3f}",
                                             topic_.columns[best.velocity].name, best.correlation);
    claim_axes("position", best.position, position_mm ? "mm" : "m", "world", evidence);
    claim_axes("velocity", best.velocity, mm ? "mm/s" : "m/s", "world",
               "derivative of " + topic_.columns[best.position].name);
    velocity_ = best.velocity;
    velocity_per_si_ = mm ? 1000 : 1;
    has_velocity_ = true;
  }

  /// For small angles, roll and pitch are -a_y / g and a_x / g.
  void angles() {
    if (!has_velocity_) return;
    static const std::vector<UnitSize> units = {
        {"rad", 1}, {"deg", 1 / kDegree_rad}, {"-rad", -1}, {"-deg", -1 / kDegree_rad}};
    Numbers tilt[2];
    for (std::size_t k = 0; k < 2; ++k) {
      tilt[k] = slope_of(topic_.time_s, values(velocity_ + 1 - k), 0.1);
      for (double& a : tilt[k]) a *= (k == 0 ? -1 : 1) / (kGravity_m_s2 * velocity_per_si_);
    }
    for (std::size_t c = 0; c + 2 <= size(); ++c) {
      if (!free(c, 2)) continue;
      const Line roll = line_through(tilt[0], values(c)), pitch = line_through(tilt[1], values(c + 1));
      if (std::abs(roll.correlation) < 0.7 || std::abs(pitch.correlation) < 0.7) continue;
      const UnitSize *const roll_unit = unit_near(units, roll.slope), *const pitch_unit =
                                                                          unit_near(units, pitch.slope);
      if (roll_unit == nullptr || pitch_unit == nullptr) continue;
      claim("roll", c, roll_unit->name, nullptr,
            fmt::format("follows -a_y / g, correlation {:.3f}", roll.correlation));
      claim("pitch", c + 1, pitch_unit->name, nullptr,
            fmt::format("follows a_x / g, correlation {:.3f}", pitch.correlation));
      if (c + 2 < size() && taken_[c + 2] == 0)
        claim("yaw", c + 2, std::abs(roll_unit->per_si) > 2 ? "deg" : "rad", nullptr,
              "it follows roll and pitch");
      return;
    }
  }

  void rates() {
    static const std::vector<UnitSize> units = {{"rad/s", 1}, {"deg/s", 1 / kDegree_rad}, {"mrad/s", 1000}};
    if (!has_quaternion_) return;
    const std::size_t n = topic_.time_s.size();
    Numbers omega[3];
    std::array<Numbers, 4> dq;
    for (std::size_t k = 0; k < 4; ++k) dq[k] = slope_of(topic_.time_s, values(quaternion_[k]), kSlope_s);
    for (std::size_t i = 0; i < n; ++i) {
      const auto q = [&](std::size_t k) { return values(quaternion_[k])[i]; };
      // Vector part of omega = 2 q* dq/dt.
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t a = (k + 1) % 3, b = (k + 2) % 3;
        omega[k].push_back(2 * (q(3) * dq[k][i] - q(k) * dq[3][i] - q(a) * dq[b][i] + q(b) * dq[a][i]));
      }
    }
    for (std::size_t c = 0; c + 3 <= size(); ++c) {
      if (!free(c, 2) || taken_[c + 2] == kTaken) continue;
      const Line x = line_through(omega[0], values(c)), y = line_through(omega[1], values(c + 1));
      const UnitSize* const unit = unit_near(units, x.slope);
      if (x.correlation < 0.7 || y.correlation < 0.7 || unit == nullptr || unit != unit_near(units, y.slope))
        continue;
      claim_axes(
          "rate", c, unit->name, "body",
          fmt::format("follows the quaternion, correlation {:.3f}", std::min(x.correlation, y.correlation)));
      return;
    }
  }

  void specific_force() {
    static const std::vector<UnitSize> units = {
        {"m/s^2", kGravity_m_s2}, {"g", 1}, {"mg", 1000}, {"mm/s^2", 1000 * kGravity_m_s2}};
    for (std::size_t c = 0; c + 3 <= size(); ++c) {
      if (!free(c, 3)) continue;
      const double size_of_all = median(norm(c, 3)), up = mean_of(values(c + 2));
      const UnitSize* const unit = unit_near(units, size_of_all);
      if (unit == nullptr || std::abs(size_of_all / unit->per_si - 1) > 0.15 || up < 0.8 * size_of_all)
        continue;
      claim_axes("specific_force", c, unit->name, "body",
                 fmt::format("{:.4g} in the middle, nearly all of it along the third: gravity", size_of_all));
      return;
    }
  }

  void motors() {
    for (std::size_t c = 0; c + 4 <= size(); ++c) {
      if (!free(c, 4)) continue;
      double low = INFINITY, high = 0, least_mean = INFINITY, largest_mean = 0;
      for (std::size_t k = c; k < c + 4; ++k) {
        low = std::min(low, quantile_of(values(k), 0));
        high = std::max(high, quantile_of(values(k), 1));
        least_mean = std::min(least_mean, median(values(k)));
        largest_mean = std::max(largest_mean, median(values(k)));
      }
      const bool is_pwm = high > 5000 && high<65536, is_share = high> 0.1 && high <= 1.001;
      if (low < 0 || (!is_pwm && !is_share) || largest_mean > 1.5 * least_mean) continue;
      for (std::size_t k = 0; k < 4; ++k)
        claim(fmt::format("duty_{}", k + 1), c + k, is_pwm ? "PWM" : "1", nullptr,
              "four with a common range; requested_1 .. 4 if they are requests before battery compensation");
      return;
    }
  }

  void battery() {
    for (std::size_t c = 0; c < size(); ++c) {
      if (taken_[c] != 0) continue;
      const Numbers& all = values(c);
      const double middle = median(all), spread = quantile_of(all, 1) - quantile_of(all, 0);
      const bool volts = middle > 2.8 && middle<60, millivolts = middle> 2800 && middle < 60000;
      const auto tenth = static_cast<std::ptrdiff_t>(all.size() / 10);
      const Numbers first(all.begin(), all.begin() + tenth), last(all.end() - tenth, all.end());
      if (!(volts || millivolts) || spread > 0.35 * middle || !(median(last) < median(first))) continue;
      claim("battery", c, volts ? "V" : "mV", nullptr,
            fmt::format("falls from {:.4g} to {:.4g}", median(first), median(last)));
      return;
    }
  }

  const RawTopic& topic_;
  std::vector<char> taken_;
  const std::vector<std::string>& known_;
  std::vector<Numbers> slopes_;
  std::vector<ColumnGuess> found_;
  bool has_quaternion_ = false, has_velocity_ = false;
  std::array<std::size_t, 4> quaternion_{};  ///< columns of x, y, z, w
  std::size_t velocity_ = 0;
  double velocity_per_si_ = 1;
};

}  // namespace

int guess_clock(const RawTopic& topic) {
  int best = -1;
  double least = INFINITY;
  for (std::size_t c = 0; c < topic.columns.size(); ++c) {
    const Numbers& values = topic.columns[c].values;
    Numbers steps;
    for (std::size_t i = 1; i < values.size(); ++i) steps.push_back(values[i] - values[i - 1]);
    const double step = median(steps);
    if (steps.size() < 10 || !(step > 0) || !(quantile_of(steps, 0.01) > 0)) continue;
    // A constant step of exactly one means a record counter; a clock has another unit or some jitter.
    double spread = (quantile_of(steps, 0.9) - quantile_of(steps, 0.1)) / step;
    if (step == 1 && spread == 0) spread = 1;
    if (spread > 1 || spread >= least) continue;
    least = spread;
    best = static_cast<int>(c);
  }
  return best;
}

std::vector<ColumnGuess> guess_columns(const RawTopic& topic, std::vector<char> taken,
                                       const std::vector<std::string>& known) {
  return Guesser(topic, std::move(taken), known).guesses();
}

std::string range_in_words(const RawColumn& column) {
  const double low = quantile_of(column.values, 0), high = quantile_of(column.values, 1);
  if (std::isnan(low)) return "no numbers";
  if (low == high) return fmt::format("always {:.6g}", low);
  return fmt::format("{:.4g} .. {:.4g}, median {:.4g}", low, high, median(column.values));
}

}  // namespace swarmcert::logs
