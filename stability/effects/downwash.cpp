#include "stability/effects/downwash.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "stability/effects/wake_shape.h"

namespace swarmcert::stability {
namespace {

/// ln g_j without the fade u. Returns false where the neighbour does nothing.
bool log_strength(const Neighbour& neighbour, const double* shape, double* result) {
  const double dz = neighbour.dp_W_m.z();
  if (dz <= kWakeTouching_m) return false;
  const double delay_s = shape[Downwash::kConvection] * dz;
  const double rx = neighbour.dp_W_m.x() - delay_s * neighbour.v_W_m_s.x();
  const double ry = neighbour.dp_W_m.y() - delay_s * neighbour.v_W_m_s.y();
  const double height_m = std::max(dz, kWakeNearest_m);
  const double spread_m = shape[Downwash::kSpread0] + shape[Downwash::kSpreadSlope] * height_m;
  const double in_spreads2 = (rx * rx + ry * ry) / (spread_m * spread_m);
  const double tail = shape[Downwash::kTail];
  if (tail == 0 && in_spreads2 > kWakeReachInSpreads * kWakeReachInSpreads) return false;
  *result = shape[Downwash::kDecay] * std::log(kWakeReference_m / height_m) -
            (tail == 0 ? 0.5 * in_spreads2 : std::log1p(0.5 * tail * in_spreads2) / tail);
  if (neighbour.mass_kg != kWakeReferenceMass_kg) {
    *result += shape[Downwash::kMassExponent] * std::log(neighbour.mass_kg / kWakeReferenceMass_kg);
  }
  return true;
}

/// 0 where vehicles touch, 1 from kWakeNearest_m on, smooth between.
double fade(double dz) {
  if (dz >= kWakeNearest_m) return 1;
  const double x = (dz - kWakeTouching_m) / (kWakeNearest_m - kWakeTouching_m);
  return x * x * (3 - 2 * x);
}

}  // namespace

EffectInfo Downwash::describe() {
  return {"downwash",
          "f_z = -A (sum_j g_j^p)^(1/p), g_j = (m_j / 0.034)^e (0.3 / dz)^n (1 + q x)^(-1/q), "
          "x = |r - k dz v_j|^2 / (2 (s0 + s1 dz)^2); exp(-x) for q = 0",
          "least squares on 103 230 samples of two published Crazyflies; composition from flights of three",
          "downwash",
          "pass and stay below another vehicle, 0.2 .. 0.6 m, and fly alone in the same flights",
          {{"amplitude_N", "force 0.3 m straight below a vehicle of 0.034 kg", 10.03299049 * kGramForce_N, 0,
            0.6}},
          {{"decay_exponent", "n", 0.44084819, 0, 4, {0.44084819, 1}},
           {"spread_m", "s0", 0.0259477, 0.005, 0.3, {0.0259477, 0.06}},
           {"spread_slope", "s1", 0.08181592, 0, 1, {0.028, 0.08181592}},
           {"norm_exponent", "p: 1 adds forces, 2 adds momentum flux", 1.3, 1, 10, {1.3, 1.85}},
           {"convection_s_m", "k: 1 / speed of the wake", 0, 0, 1, {0, 0.15}},
           {"mass_exponent", "e: 0.5 is momentum theory at equal rotor area", 0.5, 0, 2},
           {"tail", "q: 0 is a Gaussian profile, 1 a Lorentzian one", 0, 0, 1, {0, 1}}},
          false,
          true};
}

void Downwash::columns(const Instant& now, const double* shape, Wrench* columns) const {
  columns[0] = {};
  const double norm = shape[kNorm];
  double sum = 0;  // of g^p
  double single = 0, single_fade = 0;
  int count = 0;
  const auto to_the_norm = [norm](double log_strength, double faded) {
    const double power = std::exp(norm * log_strength);
    return faded == 1 ? power : power * std::pow(faded, norm);
  };
  for (int j = 0; j < now.num_neighbours; ++j) {
    double strength;
    if (!log_strength(now.neighbours[j], shape, &strength)) continue;
    const double faded = fade(now.neighbours[j].dp_W_m.z());
    if (++count == 1) {  // the common case needs no power: (g^p)^(1/p) = g
      single = strength;
      single_fade = faded;
      continue;
    }
    if (count == 2) sum = to_the_norm(single, single_fade);
    sum += to_the_norm(strength, faded);
  }
  if (count == 1) columns[0].force_W_N.z() = -single_fade * std::exp(single);
  if (count > 1) columns[0].force_W_N.z() = sum > 0 ? -std::exp(std::log(sum) / norm) : 0;
}

bool Downwash::in_support(const Instant& now, const double* shape) const {
  for (int j = 0; j < now.num_neighbours; ++j) {
    const Eigen::Vector3d& dp = now.neighbours[j].dp_W_m;
    const double spread_m = shape[kSpread0] + shape[kSpreadSlope] * dp.z();
    if (dp.z() > kWakeTouching_m && dp.z() < 1 && dp.head<2>().norm() < 2 * spread_m) return true;
  }
  return false;
}

std::vector<std::vector<double>> Downwash::grid(const FlightRange&) const {
  // Spreads that go together, from narrow and opening to wide and parallel; the product of all grids would be
  // thousands of columns. What is left out here is for refinement to find.
  const double spreads[][2] = {
      {0.0259477, 0.08181592}, {0.035, 0.1}, {0.04, 0.055}, {0.052, 0.028}, {0.06, 0.06}};
  std::vector<std::vector<double>> thetas;
  for (const auto& spread : spreads) {
    for (const double convection_s_m : {0.0, 0.15}) {
      for (const double tail : {0.0, 1.0}) {
        thetas.push_back({info().shape[kDecay].value, spread[0], spread[1], info().shape[kNorm].value,
                          convection_s_m, info().shape[kMassExponent].value, tail});
      }
    }
  }
  return thetas;
}

double Downwash::reach_m(double dz_m, const double* shape) const {
  if (dz_m <= kWakeTouching_m) return 0;
  if (shape[kTail] > 0) return std::numeric_limits<double>::infinity();
  // The wake lags by k dz |v|; 20 m/s is faster than anything this project flies.
  const double lag_m = shape[kConvection] * dz_m * 20;
  return kWakeReachInSpreads * (shape[kSpread0] + shape[kSpreadSlope] * std::max(dz_m, kWakeNearest_m)) +
         lag_m;
}

}  // namespace swarmcert::stability
