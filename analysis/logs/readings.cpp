#include "analysis/logs/readings.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>

#include "analysis/logs/signal_table.h"
#include "analysis/logs/statistics_of_series.h"

namespace swarmcert::logs {
namespace {

// Bits against what people rarely write.
constexpr double kOtherThanStated = 16, kOtherFrame = 12, kOtherOrder = 8, kFrameWord = 6;
constexpr double kNeighboursOnly = 6;  // columns that only their places in the file join

using Four = std::array<double, 4>;

/// Bits of a size under a log-normal prior with this median and factor of one standard deviation.
double size_bits(double size, double usual, double factor) {
  if (!(size > 0)) return 0;
  const double deviations = std::log(size / usual) / std::log(factor);
  return -std::min(14.0, 0.7213 * deviations * deviations);  // 1 / (2 ln 2)
}

double spread_of(const std::vector<double>& values) {
  return values.empty() ? 0 : quantile_of(values, 0.95) - quantile_of(values, 0.05);
}

double largest_spread(const Reading& reading) {
  return std::max({spread_of(reading.value[0]), spread_of(reading.value[1]), spread_of(reading.value[2])});
}

const std::vector<double>& stored(const RawLog& log, const Carried& carried, std::size_t k) {
  return log.topics[carried.topic].columns[static_cast<std::size_t>(carried.columns[k])].values;
}

/// Fills value and slope of the first three columns, as stored.
void fill_vector(const RawLog& log, const Knots& knots, Reading& reading) {
  const Carried& carried = reading.carried;
  for (std::size_t k = 0; k < 3 && k < carried.size(); ++k) {
    if (carried.columns[k] < 0) continue;
    KnotSeries series = at_knots(knots, log.topics[carried.topic].time_s, stored(log, carried, k));
    reading.value[k] = std::move(series.value);
    reading.slope[k] = std::move(series.slope);
  }
}

/// Scales the series of `from`, read in another unit and frame.
Reading scaled(const Reading& from, double factor, bool is_turned) {
  Reading reading = from;
  for (std::size_t k = 0; k < 3; ++k) {
    const double sign = is_turned && k > 0 ? -1 : 1;
    reading.carried.sign[k] = sign;
    for (ThreeSeries* const series : {&reading.value, &reading.slope})
      for (double& value : (*series)[k]) value *= sign * factor;
  }
  reading.is_down = is_turned;
  return reading;
}

struct UnitPrior {
  const char* name;
  double bits;
};

/// Turns q about the x axis of W (left) and of B (right), conjugated first where the inverse rotation is stored.
struct QuaternionForm {
  std::array<std::size_t, 4> part;  ///< of the stored four that becomes x, y, z, w
  Four sign;
};
QuaternionForm form_of(bool w_first, bool is_inverse, bool left, bool right) {
  QuaternionForm form{
      w_first ? std::array<std::size_t, 4>{1, 2, 3, 0} : std::array<std::size_t, 4>{0, 1, 2, 3},
      {1, 1, 1, 1}};
  if (is_inverse) form.sign = {-1, -1, -1, 1};
  const auto take = [&form](const std::array<std::size_t, 4>& from, const Four& sign) {
    const QuaternionForm old = form;
    for (std::size_t i = 0; i < 4; ++i) {
      form.part[i] = old.part[from[i]];
      form.sign[i] = sign[i] * old.sign[from[i]];
    }
  };
  if (left) take({3, 2, 1, 0}, {1, -1, 1, -1});   // i q
  if (right) take({3, 2, 1, 0}, {-1, -1, 1, 1});  // q (-i)
  return form;
}

/// Fills rotation, and as `value` the body rates 2 q* dq/dt from differences over neighbouring knots.
void fill_rotation(const Knots& knots, const std::array<std::vector<double>, 4>& q, Reading& reading) {
  const std::size_t n = knots.time_s.size();
  for (auto& entry : reading.rotation) entry.assign(n, kNaN);
  for (auto& axis : reading.value) axis.assign(n, kNaN);
  std::vector<Attitude> attitudes(n);
  for (std::size_t i = 0; i < n; ++i) {
    const double norm =
        std::sqrt(q[0][i] * q[0][i] + q[1][i] * q[1][i] + q[2][i] * q[2][i] + q[3][i] * q[3][i]);
    attitudes[i] = {q[0][i] / norm, q[1][i] / norm, q[2][i] / norm, q[3][i] / norm};
    const auto R = attitudes[i].rotation();
    for (std::size_t k = 0; k < 9; ++k) reading.rotation[k][i] = R[k / 3][k % 3];
  }
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const Attitude &a = attitudes[i - 1], &b = attitudes[i + 1];
    const double dot = a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w;
    const double factor = (dot < 0 ? -2 : 2) / (knots.time_s[i + 1] - knots.time_s[i - 1]);
    reading.value[0][i] = factor * (a.w * b.x - a.x * b.w - a.y * b.z + a.z * b.y);
    reading.value[1][i] = factor * (a.w * b.y - a.y * b.w - a.z * b.x + a.x * b.z);
    reading.value[2][i] = factor * (a.w * b.z - a.z * b.w - a.x * b.y + a.y * b.x);
  }
}

/// A vehicle that flies is upright most of the time.
double upright_bits(const Reading& reading) {
  const double up = median(reading.rotation[8]);
  return up > 0.8 ? 3 : up > 0.5 ? 0 : -40;
}

class Reader {
 public:
  Reader(const RawLog& log, const Knots& knots, const ColumnGroup& group, Quantity quantity)
      : log_(log), knots_(knots), group_(group) {
    base_.name_bits = group.bits[quantity] - (group.kind == IndexKind::kNone ? kNeighboursOnly : 0);
    base_.bits = base_.name_bits;
    base_.carried.topic = group.topic;
    base_.carried.columns = group.columns;
  }

  std::vector<Reading> lengths(int signal, const std::string& what, const std::string& per_time, double usual,
                               double factor) {
    const bool is_place = per_time.empty();
    for (const UnitPrior& unit : {UnitPrior{"m", 0}, {"mm", kOtherUnit}, {"cm", kOtherUnit}})
      each_frame(signal, what, unit.name + per_time, unit.bits, [&](Reading& reading) {
        reading.bits += size_bits(largest_spread(reading), usual, factor);
        if (is_place) reading.bits += height_bits(reading);
      });
    return std::move(readings_);
  }

  std::vector<Reading> specific_forces() {
    if (!is_whole()) return {};
    for (const UnitPrior& unit :
         {UnitPrior{"m/s^2", 0}, {"g", 1}, {"mg", kOtherUnit}, {"mm/s^2", kOtherUnit}})
      for (const int signal : {kForceBody, kForceWorld})
        each_frame(
            signal,
            signal == kForceBody ? "specific force along body axes" : "specific force along world axes",
            unit.name, unit.bits + (signal == kForceWorld ? kOtherFrame : 0),
            [&](Reading& reading) { reading.bits += gravity_bits(reading); });
    return std::move(readings_);
  }

  std::vector<Reading> rates() {
    if (!is_whole()) return {};
    for (const UnitPrior& unit : {UnitPrior{"rad/s", 0}, {"deg/s", 1}, {"mrad/s", kOtherUnit}})
      each_frame(kRates, "body rates", unit.name, unit.bits,
                 [&](Reading& reading) { reading.bits += size_bits(largest_spread(reading), 1, 6); });
    return std::move(readings_);
  }

  std::vector<Reading> quaternions() {
    if (group_.columns.size() != 4 || !is_whole() ||
        !is_unit_quaternion(log_.topics[group_.topic], group_.columns))
      return {};
    std::array<KnotSeries, 4> parts = quaternion_parts();
    const double norm_bits = unit_norm_bits();
    for (const bool w_first : {false, true}) {
      // w is named, or an array usually begins with it.
      const double order_bits = group_.kind == IndexKind::kAxis ? (w_first ? kOtherOrder : 0)
                                : w_first                       ? 0
                                                                : 1;
      for (const bool is_inverse : {false, true})
        for (const int turn : {0, 1, 2, 3}) {
          const bool left = turn % 2 == 1, right = turn / 2 == 1;
          const QuaternionForm form = form_of(w_first, is_inverse, left, right);
          Reading reading = base_;
          reading.carried.signal = kAttitude;
          reading.carried.unit = "1";
          std::array<std::vector<double>, 4> q;
          for (std::size_t i = 0; i < 4; ++i) {
            reading.carried.columns[i] = group_.columns[form.part[i]];
            reading.carried.sign[i] = form.sign[i];
            q[i] = parts[form.part[i]].value;
            for (double& value : q[i]) value *= form.sign[i];
          }
          fill_rotation(knots_, q, reading);
          reading.is_down = left && right;
          reading.bits += frame_word_bits(reading.is_down) + norm_bits + upright_bits(reading) - order_bits -
                          (is_inverse ? kOtherFrame : 0) - (left != right ? kOtherFrame : 0);
          reading.words = fmt::format("quaternion {}{}{}", w_first ? "w x y z" : "x y z w",
                                      is_inverse ? ", inverse" : "", frame_words(left, right));
          readings_.push_back(std::move(reading));
        }
    }
    return std::move(readings_);
  }

  std::vector<Reading> angles() {
    if (group_.columns.size() != 3 || group_.columns[0] < 0 || group_.columns[1] < 0) return {};
    for (const UnitPrior& unit : {UnitPrior{"rad", 0}, {"deg", 0}})
      for (int signs = 0; signs < (group_.columns[2] < 0 ? 4 : 8); ++signs) {
        Reading reading = base_;
        if (!set_unit(reading, kEuler, unit.name, unit.bits)) continue;
        for (std::size_t k = 0; k < 3; ++k) reading.carried.sign[k] = (signs >> k) % 2 == 1 ? -1 : 1;
        const bool is_down = (signs | 4) == 6;
        add_angles(reading, is_down);
        const bool is_usual = signs == 0 || is_down;
        reading.bits += frame_word_bits(is_down) - (is_usual ? 0 : kOtherFrame);
        reading.words = fmt::format("angles in {}{}", unit.name,
                                    signs == 0 ? ""
                                    : is_down  ? frame_words(true, true)
                                               : ", some of opposite sign");
        readings_.push_back(std::move(reading));
      }
    return std::move(readings_);
  }

 private:
  bool is_whole() const { return std::count(group_.columns.begin(), group_.columns.end(), -1) == 0; }

  static std::string frame_words(bool left, bool right) {
    return left && right ? ", north east down" : left ? ", world z down" : right ? ", body z down" : "";
  }

  /// Sets the unit and its bits; false if it cannot be.
  bool set_unit(Reading& reading, int signal, const std::string& unit, double against) const {
    const std::optional<UnitFactor> factor = unit_factor(signal, unit);
    if (!factor) return false;
    reading.carried.signal = signal;
    reading.carried.unit = unit;
    reading.carried.factor = *factor;
    const bool is_stated = !group_.unit.empty() && unit_factor(signal, group_.unit);
    reading.bits -= !is_stated ? against : group_.unit == unit ? 0 : kOtherThanStated;
    return true;
  }

  template <typename Judge>
  void each_frame(int signal, const std::string& what, const std::string& unit, double against,
                  const Judge& judge) {
    Reading plain = base_;
    if (group_.columns.size() != 3 || !set_unit(plain, signal, unit, against)) return;
    const double factor = plain.carried.factor.scale();
    if (series_.value[0].empty() && series_.value[1].empty() && series_.value[2].empty()) {
      series_ = base_;
      fill_vector(log_, knots_, series_);
    }
    plain.value = series_.value;
    plain.slope = series_.slope;
    for (const bool is_down : {false, true}) {
      // A compass names its frame; without y and z there is none.
      if (group_.kind == IndexKind::kCompass && is_down == group_.is_east_north_up) continue;
      Reading reading = scaled(plain, factor, is_down);
      reading.words = fmt::format("{} in {}{}", what, unit, is_down ? ", z down" : "");
      reading.bits += frame_word_bits(is_down);
      judge(reading);
      readings_.push_back(std::move(reading));
    }
  }

  /// A compass and words like "ned" say which frame is meant.
  double frame_word_bits(bool is_down) const {
    const bool says_down =
        group_.says_down || (group_.kind == IndexKind::kCompass && !group_.is_east_north_up);
    return (is_down ? kFrameWord : -kFrameWord) * (says_down ? 1 : group_.says_up ? -1 : 0);
  }

  /// Vehicles fly above the place from which they started, and rooms have their origin on the floor.
  static double height_bits(const Reading& reading) {
    const std::vector<double>& z = reading.value[2];
    if (z.empty()) return 0;
    const auto first = std::find_if(z.begin(), z.end(), [](double x) { return std::isfinite(x); });
    if (first == z.end()) return 0;
    const auto share = [](double height_m) { return std::clamp(height_m / 0.4, -1.0, 1.0); };
    return 4 * share(median(z)) + 4 * share(median(z) - *first);
  }

  /// The median size of a specific force is 1 g, most of it along z: what else shows is no accelerometer of this unit.
  static double gravity_bits(const Reading& reading) {
    constexpr double kNever = -200;
    std::vector<double> sizes;
    for (std::size_t i = 0; i < reading.value[0].size(); ++i)
      sizes.push_back(std::hypot(reading.value[0][i], reading.value[1][i], reading.value[2][i]));
    const double size = median(sizes), up = median(reading.value[2]);
    const bool is_gravity = std::abs(size / kGravity_m_s2 - 1) < 0.3 && up > 0.7 * size;
    return is_gravity ? 6 + 3 * size_bits(size, kGravity_m_s2, 1.1) : kNever;
  }

  /// Returns the four parts at the knots.
  std::array<KnotSeries, 4> quaternion_parts() const {
    const RawTopic& topic = log_.topics[group_.topic];
    const std::vector<double> signs = continuous_signs(topic, group_.columns);
    std::array<KnotSeries, 4> series;
    for (std::size_t k = 0; k < 4; ++k) {
      std::vector<double> part = stored(log_, base_.carried, k);
      for (std::size_t i = 0; i < part.size(); ++i) part[i] *= signs[i];
      series[k] = at_knots(knots_, topic.time_s, part);
    }
    return series;
  }

  /// A unit norm is rare by chance, unless the four are constant.
  double unit_norm_bits() const {
    bool changes = false;
    for (std::size_t k = 0; k < 4; ++k) {
      const std::vector<double>& part = stored(log_, base_.carried, k);
      changes = changes || quantile_of(part, 1) > quantile_of(part, 0);
    }
    return changes ? 40 : 4;
  }

  /// R = Rz(yaw) Ry(pitch) Rx(roll).
  void add_angles(Reading& reading, bool is_down) {
    const RawTopic& topic = log_.topics[group_.topic];
    ThreeSeries angle;
    double size = 0, largest = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      angle[k].assign(knots_.time_s.size(), 0);
      if (group_.columns[k] < 0) continue;
      std::vector<double> values = stored(log_, base_.carried, k);
      const double factor = reading.carried.sign[k] * reading.carried.factor.scale();
      largest = std::max(largest, std::abs(quantile_of(values, 0.99) * factor));
      for (double& value : values) value *= factor;
      unwrap(values);
      angle[k] = at_knots(knots_, topic.time_s, values).value;
      if (k < 2) size = std::max(size, spread_of(angle[k]));
    }
    std::array<std::vector<double>, 4> q;
    for (auto& part : q) part.resize(knots_.time_s.size());
    for (std::size_t i = 0; i < knots_.time_s.size(); ++i) {
      const std::array<double, 4> xyzw = attitude_of_angles(angle[0][i], angle[1][i], angle[2][i]).xyzw();
      for (std::size_t k = 0; k < 4; ++k) q[k][i] = xyzw[k];
    }
    fill_rotation(knots_, q, reading);
    reading.is_down = is_down;
    reading.bits += upright_bits(reading) + size_bits(size, 0.2, 4) - (largest > 7 ? 40 : 0);
  }

  const RawLog& log_;
  const Knots& knots_;
  const ColumnGroup& group_;
  Reading base_, series_;
  std::vector<Reading> readings_;
};

std::optional<Quantity> quantity_of(int signal) {
  if (signal == kForceWorld) return kIsSpecificForce;
  const auto* const found = std::find(std::begin(kSignalOfQuantity), std::end(kSignalOfQuantity), signal);
  if (found == std::end(kSignalOfQuantity)) return std::nullopt;
  return static_cast<Quantity>(found - kSignalOfQuantity);
}

}  // namespace

std::vector<Reading> readings_of(const RawLog& log, const Knots& knots, const ColumnGroup& group,
                                 Quantity quantity) {
  Reader reader(log, knots, group, quantity);
  if (quantity == kIsSpecificForce) return reader.specific_forces();
  if (quantity == kIsRates) return reader.rates();
  if (quantity == kIsQuaternion) return reader.quaternions();
  if (quantity == kIsAngles) return reader.angles();
  const bool is_target = quantity == kIsTargetPosition || quantity == kIsTargetVelocity;
  const std::string prefix = is_target ? "target " : "";
  return quantity == kIsPosition || quantity == kIsTargetPosition
             ? reader.lengths(is_target ? kTargetPosition : kPosition, prefix + "position", "", 1.5, 10)
             : reader.lengths(is_target ? kTargetVelocity : kVelocity, prefix + "velocity", "/s", 1, 6);
}

std::vector<Reading> readings_of_known(const RawLog& log, const Knots& knots, const Carried& carried) {
  constexpr double kKnown = 40;
  const std::optional<Quantity> quantity = quantity_of(carried.signal);
  if (!quantity || carried.ask == Ask::kVelocityFrame) return {};
  ColumnGroup group;
  group.topic = carried.topic;
  group.columns = carried.columns;
  group.unit = carried.unit;
  group.kind = IndexKind::kAxis;
  group.bits[*quantity] = kKnown;
  std::vector<Reading> readings = readings_of(log, knots, group, *quantity);
  const auto named = std::find_if(readings.begin(), readings.end(), [&](const Reading& reading) {
    return is_same_reading(reading.carried, carried);
  });
  if (named == readings.end()) return {};
  std::rotate(readings.begin(), named, named + 1);
  return readings;
}

bool is_same_reading(const Carried& a, const Carried& b) {
  return a.signal == b.signal && a.columns == b.columns && a.sign == b.sign &&
         is_same_scale(a.factor, b.factor);
}

bool is_same_signal(const Reading& a, const Reading& b) {
  const auto differ = [](const std::vector<double>& x, const std::vector<double>& y, double least) {
    if (x.empty() != y.empty()) return true;
    double squares = 0, count = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      if (!std::isfinite(x[i] - y[i])) continue;
      squares += (x[i] - y[i]) * (x[i] - y[i]);
      ++count;
    }
    return count > 0 && std::sqrt(squares / count) > std::max(least, 0.02 * spread_of(x));
  };
  if (a.is_attitude() != b.is_attitude()) return false;
  if (!a.is_attitude() && a.carried.signal != b.carried.signal) return false;
  if (a.is_attitude()) {
    for (std::size_t k = 0; k < 9; ++k)
      if (differ(a.rotation[k], b.rotation[k], 0.02)) return false;
    return true;
  }
  for (std::size_t k = 0; k < 3; ++k)
    if (differ(a.value[k], b.value[k], 1e-3)) return false;
  return true;
}

double Knots::independent(std::size_t count) const {
  constexpr double kMemory_s = 0.2;  // of a vehicle's motion
  return static_cast<double>(count) * std::min(1.0, step_s / kMemory_s);
}

Knots knots_of(const RawLog& log) {
  const RawTopic* longest = nullptr;
  for (const RawTopic& topic : log.topics) {
    if (!is_plain_table(log, topic)) continue;
    if (longest == nullptr || topic.time_s.size() > longest->time_s.size()) longest = &topic;
  }
  Knots knots;
  if (longest == nullptr || longest->time_s.size() < 8) return knots;
  std::vector<double> steps = steps_of(longest->time_s);
  steps.erase(std::remove_if(steps.begin(), steps.end(), [](double step) { return !(step > 0); }),
              steps.end());
  const double first = quantile_of(longest->time_s, 0), last = quantile_of(longest->time_s, 1);
  const double step = median(steps);
  if (!(step > 0)) return knots;
  knots.window_s = std::max(0.1, 4.01 * step);
  knots.step_s = knots.window_s / 2;
  const double most_s = knots.step_s * static_cast<double>(Knots::kMost - 1);
  // The middle of a long log is flight.
  double now = last - first > most_s ? (first + last - most_s) / 2 : first;
  for (; now <= last && knots.time_s.size() < Knots::kMost; now += knots.step_s) knots.time_s.push_back(now);
  return knots;
}

KnotSeries at_knots(const Knots& knots, const std::vector<double>& time_s,
                    const std::vector<double>& values) {
  KnotSeries series{std::vector<double>(knots.time_s.size(), kNaN),
                    std::vector<double>(knots.time_s.size(), kNaN)};
  std::size_t from = 0;
  for (std::size_t k = 0; k < knots.time_s.size(); ++k) {
    const double now = knots.time_s[k];
    while (from < time_s.size() && !(time_s[from] >= now - knots.window_s / 2)) ++from;
    double count = 0, st = 0, sx = 0, stt = 0, stx = 0;
    for (std::size_t i = from; i < time_s.size() && time_s[i] <= now + knots.window_s / 2; ++i) {
      if (!std::isfinite(values[i])) continue;
      const double t = time_s[i] - now;
      ++count;
      st += t, sx += values[i], stt += t * t, stx += t * values[i];
    }
    const double spread = count * stt - st * st;
    if (count < 3 || !(spread > 0)) continue;
    series.slope[k] = (count * stx - st * sx) / spread;
    series.value[k] = (sx - series.slope[k] * st) / count;
  }
  return series;
}

std::vector<double> difference_of(const Knots& knots, const std::vector<double>& series) {
  std::vector<double> difference(series.size(), kNaN);
  for (std::size_t i = 1; i + 1 < series.size(); ++i)
    difference[i] = (series[i + 1] - series[i - 1]) / (knots.time_s[i + 1] - knots.time_s[i - 1]);
  return difference;
}

}  // namespace swarmcert::logs
