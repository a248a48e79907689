#include "stability/bounds/uncertain_norms.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace swarmcert::stability {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::array<double GainNorms::*, 4> kGains = {&GainNorms::rate, &GainNorms::amplitude,
                                                       &GainNorms::edge, &GainNorms::impulse};

/// mass, thrust scale, lag, delay
using Point = std::array<double, 4>;

struct Part {
  Point from{}, to{};
  std::array<double, 4> upper{};  ///< of each gain
  double spread[3] = {0, 0, 0};   ///< what thrust/mass, lag and delay contribute to |T Delta|_1
};

class Subdivision {
 public:
  Subdivision(const AxisLoop& loop, Channel channel) : loop_(loop), channel_(channel) {}

  AxisLoop at(const Point& p) const {
    AxisLoop loop = loop_;
    const double scale = p[1] * loop_.mass_kg / p[0];
    loop.mass_kg = p[0];
    loop.Kp *= scale;
    loop.Kd *= scale;
    loop.Ki *= scale;
    loop.lags_s.insert(loop.lags_s.begin(), p[2]);
    loop.delay_s = p[3];
    return loop;
  }

  GainNorms evaluate(const Point& p, UncertainNorms& result) {
    const GainNorms norms = continuous_norms(at(p), channel_);
    UncertainGain* const gains[] = {&result.rate, &result.amplitude, &result.edge, &result.impulse};
    for (std::size_t k = 0; k < 4; ++k) {
      if (norms.*kGains[k] > gains[k]->lower) {
        *gains[k] = {norms.*kGains[k], gains[k]->upper, p[0], p[1], p[2], p[3]};
      }
    }
    ++result.evaluations;
    return norms;
  }

  void bound(Part& part, UncertainNorms& result) {
    Point centre;
    for (std::size_t i = 0; i < 4; ++i) centre[i] = (part.from[i] + part.to[i]) / 2;
    // The thrust per mass of the part around its geometric middle.
    const double ratio_from = part.from[1] / part.to[0];
    const double ratio_to = part.to[1] / part.from[0];
    const double ratio = centre[1] / centre[0];
    const double relative = std::max(ratio_to / ratio - 1, 1 - ratio_from / ratio);
    const double lag_change = (part.to[2] - part.from[2]) / 2;
    const double lag = lag_change > 0 ? (part.from[2] > 0 ? 2 * lag_change / part.from[2] : kInfinity) : 0;
    const double delay_change = (part.to[3] - part.from[3]) / 2;
    const GainNorms norms = evaluate(centre, result);
    part.upper.fill(kInfinity);
    part.spread[0] = relative;
    part.spread[1] = lag;
    part.spread[2] = delay_change;
    if (!std::isfinite(norms.amplitude)) return;
    const AxisLoop loop = at(centre);
    // T = (Kd s^2 + Kp s + Ki) e^(-Ts) / D(s): the command that a command of the plant comes back as.
    TransferFunction T = step_transfer(loop, Channel::kCommand);
    T.numerator = {loop.Ki, loop.Kp, loop.Kd};
    const ResponseNorms response = response_norms(T);
    const bool has_lag = T.denominator.size() > 4;
    const double jump = has_lag ? 0 : loop.Kd;
    const double changed = (1 + relative) * (1 + lag);
    part.spread[2] = delay_change * (response.variation + jump) / std::max(response.integral_abs, 1e-300);
    const double loop_gain =
        (changed - 1) * response.integral_abs + changed * delay_change * (response.variation + jump);
    if (!(loop_gain < 1)) return;
    const double enters = channel_ == Channel::kCommand ? changed : 1;
    for (std::size_t k = 0; k < 4; ++k) {
      // The centre's gain is per its own mass.
      part.upper[k] = norms.*kGains[k] * centre[0] / part.from[0] * enters / (1 - loop_gain);
    }
  }

  /// Halves what contributes most.
  std::array<Part, 2> split(const Part& part) const {
    std::size_t dimension = 0;
    const double mass = part.to[0] / part.from[0] - 1;
    const double scale = part.to[1] / part.from[1] - 1;
    dimension = 2 * mass > scale ? 0 : 1;  // mass enters twice
    double most = std::max(2 * mass, scale) / 2;
    if (part.spread[1] > most) most = part.spread[1], dimension = 2;
    if (part.spread[2] > most) dimension = 3;
    Part low = part;
    Part high = part;
    low.to[dimension] = high.from[dimension] = (part.from[dimension] + part.to[dimension]) / 2;
    return {low, high};
  }

 private:
  AxisLoop loop_;
  Channel channel_;
};

}  // namespace

UncertainNorms uncertain_norms(const AxisLoop& loop, const UncertainPlant& plant, Channel channel,
                               double relative_gap, int most_evaluations) {
  UncertainNorms result;
  Subdivision subdivision(loop, channel);
  Part whole;
  const Range ranges[] = {plant.mass_kg, plant.thrust_scale, plant.lag_s, plant.delay_s};
  for (std::size_t i = 0; i < 4; ++i) {
    whole.from[i] = ranges[i].from;
    whole.to[i] = ranges[i].to;
  }
  for (int corner = 0; corner < 16; ++corner) {
    Point p;
    for (std::size_t i = 0; i < 4; ++i) p[i] = (corner >> i) % 2 == 0 ? whole.from[i] : whole.to[i];
    subdivision.evaluate(p, result);
  }
  subdivision.bound(whole, result);
  std::vector<Part> parts = {whole};
  UncertainGain* const gains[] = {&result.rate, &result.amplitude, &result.edge, &result.impulse};
  while (true) {
    // The part and gain that are farthest from what was reached.
    std::size_t worst = 0;
    double worst_ratio = 0;
    for (std::size_t k = 0; k < 4; ++k) gains[k]->upper = gains[k]->lower;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      for (std::size_t k = 0; k < 4; ++k) {
        gains[k]->upper = std::max(gains[k]->upper, parts[i].upper[k]);
        if (std::isinf(gains[k]->lower)) continue;  // nothing to prove: it is infinite
        const double ratio = parts[i].upper[k] / gains[k]->lower;
        if (ratio > worst_ratio) worst_ratio = ratio, worst = i;
      }
    }
    if (worst_ratio <= 1 + relative_gap || result.evaluations >= most_evaluations) break;
    const std::array<Part, 2> halves = subdivision.split(parts[worst]);
    parts[worst] = halves[0];
    subdivision.bound(parts[worst], result);
    parts.push_back(halves[1]);
    subdivision.bound(parts.back(), result);
  }
  return result;
}

}  // namespace swarmcert::stability
