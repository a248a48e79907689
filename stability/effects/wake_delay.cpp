/// @file Downwash that arrives with a delay, and meanwhile drifts with the wind.
#include <algorithm>
#include <array>
#include <cmath>

#include "stability/effects/downwash.h"
#include "stability/effects/effect_entry.h"

namespace swarmcert::stability {
namespace {

enum DelayedShape {
  kDelay,
  kDelayedDecay,
  kDelayedSpread0,
  kDelayedSpreadSlope,
  kDelayedNorm,
  kWindX,
  kWindY
};

constexpr int kMostAtOnce = 64;

/// The shape parameters for Downwash: without convection and tail, for vehicles of equal rotor area.
std::array<double, 7> downwash_shape(const double* shape) {
  return {shape[kDelayedDecay],
          shape[kDelayedSpread0],
          shape[kDelayedSpreadSlope],
          shape[kDelayedNorm],
          0,
          0.5,
          0};
}

WakeDrift drift_of(const double* shape) { return {shape[kDelay], {shape[kWindX], shape[kWindY], 0}}; }

/// Returns `now` with its nearest neighbours at the positions to which the wakes that arrive now have drifted; `past`
/// is scratch for kMostAtOnce neighbours.
Instant with_past_neighbours(const Instant& now, const double* shape, Neighbour* past) {
  const WakeDrift drift = drift_of(shape);
  Instant then = now;
  then.neighbours = past;
  then.num_neighbours = std::min(now.num_neighbours, kMostAtOnce);
  for (int j = 0; j < then.num_neighbours; ++j) {
    past[j] = now.neighbours[j];
    past[j].dp_W_m = drift.dp_W_m(past[j]);
  }
  return then;
}

/// The wake of downwash.h with a WakeDrift, in a horizontal wind. With zero delay it is the downwash without
/// convection.
class WakeDelay : public Effect {
 public:
  WakeDelay()
      : Effect({"wake_delay",
                "downwash of neighbours at p_j + d (w - v_j)",
                "a wake sinks at 2 to 7 m/s: what arrives now left the rotors 0.05 to 0.3 s ago",
                "wake_delay",
                "pass below a vehicle that crosses at 0.5 m/s or more, in all directions",
                {{"amplitude_N",
                  "force 0.3 m straight below a vehicle of 0.034 kg",
                  0.09,
                  0,
                  2,
                  {},
                  Unit::kWeight}},
                {{"delay_s", "d", 0, 0, 0.5, {0.1, 0.2, 0.3, 0.4}},
                 {"decay_exponent", "as of downwash", 0.44084819, 0, 4, {0, 0.44084819}},
                 {"spread_m", "as of downwash", 0.0259477, 0.005, 0.3, {0.0259477, 0.06}},
                 {"spread_slope", "as of downwash", 0.08181592, 0, 1, {0.028, 0.08181592}},
                 {"norm_exponent", "as of downwash", 1.3, 1, 10},
                 {"wind_x_m_s", "w: wind that carries the wake", 0, -5, 5, {0, 1.6}},
                 {"wind_y_m_s", "", 0, -5, 5, {0, 1.6}}},
                false,
                true},
               {Family::kWake, Family::kWake}) {}
  void columns(const Instant& now, const double* shape, Wrench* columns) const override {
    columns_along(&now, 1, shape, columns);
  }
  void columns_along(const Instant* instants, int count, const double* shape,
                     Wrench* columns) const override {
    wake_.drifted_columns(instants, count, downwash_shape(shape).data(), drift_of(shape), columns);
  }
  bool in_support(const Instant& now, const double* shape) const override {
    std::array<Neighbour, kMostAtOnce> past;
    return wake_.in_support(with_past_neighbours(now, shape, past.data()), downwash_shape(shape).data());
  }
  std::vector<std::vector<double>> grid(const FlightRange&) const override {
    const double spreads[][2] = {{0.0259477, 0.08181592}, {0.06, 0.06}, {0.13, 0.03}};
    const double decay = info().shape[kDelayedDecay].value, norm = info().shape[kDelayedNorm].value;
    std::vector<std::vector<double>> thetas;
    for (const double delay_s : info().shape[kDelay].grid) {
      for (const auto& spread : spreads) thetas.push_back({delay_s, decay, spread[0], spread[1], norm, 0, 0});
    }
    // A wide wake, displaced by 0.16, 0.32 and 0.48 m in several directions as starting points for refinement. At
    // larger distances there are more directions, so that one of them is always within the width of the wake.
    constexpr double kDelay_s = 0.2, kTurn = 6.283185307179586;
    const struct {
      double wind_m_s;
      int sides;
    } drifts[] = {{0.8, 8}, {1.6, 8}, {2.4, 12}};
    for (const auto& drift : drifts) {
      for (int side = 0; side < drift.sides; ++side) {
        const double bearing = kTurn * side / drift.sides;
        thetas.push_back({kDelay_s, decay, 0.13, 0.03, norm, drift.wind_m_s * std::cos(bearing),
                          drift.wind_m_s * std::sin(bearing)});
      }
    }
    return thetas;
  }

 private:
  Downwash wake_;
};

}  // namespace

EffectEntry effects::wake_delay() { return effect_entry<WakeDelay>(); }

}  // namespace swarmcert::stability
