#include "stability/effects/wake_delay.h"

#include <algorithm>
#include <array>

namespace swarmcert::stability {
namespace {

enum DelayedShape { kDelay, kDelayedDecay, kDelayedSpread0, kDelayedSpreadSlope, kDelayedNorm };

constexpr int kMostAtOnce = 64;

/// As Downwash wants it: without convection and tail, for vehicles of equal rotor area.
std::array<double, 7> downwash_shape(const double* shape) {
  return {shape[kDelayedDecay],
          shape[kDelayedSpread0],
          shape[kDelayedSpreadSlope],
          shape[kDelayedNorm],
          0,
          0.5,
          0};
}

/// `now` among its nearest neighbours where they were; `past` is scratch of kMostAtOnce.
Instant with_past_neighbours(const Instant& now, double delay_s, Neighbour* past) {
  Instant then = now;
  then.neighbours = past;
  then.num_neighbours = std::min(now.num_neighbours, kMostAtOnce);
  for (int j = 0; j < then.num_neighbours; ++j) {
    past[j] = now.neighbours[j];
    past[j].dp_W_m -= delay_s * past[j].v_W_m_s;
  }
  return then;
}

}  // namespace

EffectInfo WakeDelay::describe() {
  return {"wake_delay",
          "downwash of neighbours at p_j - d v_j",
          "a wake sinks at 2 to 7 m/s: what arrives now left the rotors 0.05 to 0.3 s ago",
          "wake_delay",
          "pass below a vehicle that crosses at 0.5 m/s or more, in both directions",
          {{"amplitude_N", "force 0.3 m straight below a vehicle of 0.034 kg", 0.09, 0, 0.6}},
          {{"delay_s", "d", 0, 0, 0.5, {0.1, 0.2, 0.3, 0.4}},
           {"decay_exponent", "as of downwash", 0.44084819, 0, 4, {0, 0.44084819}},
           {"spread_m", "as of downwash", 0.0259477, 0.005, 0.3, {0.0259477, 0.06}},
           {"spread_slope", "as of downwash", 0.08181592, 0, 1, {0.028, 0.08181592}},
           {"norm_exponent", "as of downwash", 1.3, 1, 10}},
          false,
          true};
}

void WakeDelay::columns(const Instant& now, const double* shape, Wrench* columns) const {
  std::array<Neighbour, kMostAtOnce> past;
  wake_.columns(with_past_neighbours(now, shape[kDelay], past.data()), downwash_shape(shape).data(), columns);
}

bool WakeDelay::in_support(const Instant& now, const double* shape) const {
  std::array<Neighbour, kMostAtOnce> past;
  return wake_.in_support(with_past_neighbours(now, shape[kDelay], past.data()),
                          downwash_shape(shape).data());
}

std::vector<std::vector<double>> WakeDelay::grid(const FlightRange&) const {
  const double spreads[][2] = {{0.0259477, 0.08181592}, {0.06, 0.06}, {0.13, 0.03}};
  std::vector<std::vector<double>> thetas;
  for (const double delay_s : info().shape[kDelay].grid) {
    for (const auto& spread : spreads)
      thetas.push_back({delay_s, info().shape[kDelayedDecay].value, spread[0], spread[1],
                        info().shape[kDelayedNorm].value});
  }
  return thetas;
}

}  // namespace swarmcert::stability
