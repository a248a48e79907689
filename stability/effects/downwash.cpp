#include "stability/effects/downwash.h"

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#include <immintrin.h>
#endif

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <type_traits>
#include <utility>

#include "stability/bodies/kernel_width.h"
#include "stability/bodies/swarm_pairs.h"
#include "stability/effects/function_tables.h"
#include "stability/effects/wake_shape.h"

namespace swarmcert::stability {
namespace {

/// Pairs side by side in blocks of kRowLength, in the order of columns().
struct PairRows {
  const double *dx_m, *dy_m, *dz_m;  ///< the neighbour's position minus the vehicle's, in W
  const double *vx_m_s, *vy_m_s;     ///< the neighbour's velocity
  const double* constant;            ///< pair_constant() of the neighbour
};

constexpr int round_up(int count, int block) { return (count + block - 1) / block * block; }

#define SWARMCERT_KERNEL_FILE "stability/effects/downwash_kernel.inc"
#include "stability/bodies/kernel_widths.inc"

struct WakeKernel {
  int block;
  decltype(&narrow::strengths) strengths;
  decltype(&narrow::swarm_forces) swarm_forces;
  decltype(&narrow::compose_row) compose_row;
  decltype(&narrow::logarithm_of_one) logarithm_of_one;
};

/// Selects the narrowest kernel that takes `count` at once, or else the widest of this processor.
const WakeKernel& kernel_for([[maybe_unused]] int count) {
#if defined(SWARMCERT_WIDE_KERNELS)
  static constexpr WakeKernel kAvx2 = {avx2::kBlock, avx2::strengths, avx2::swarm_forces, avx2::compose_row,
                                       avx2::logarithm_of_one};
  static constexpr WakeKernel kAvx512 = {avx512::kBlock, avx512::strengths, avx512::swarm_forces,
                                         avx512::compose_row, avx512::logarithm_of_one};
  if (count > avx2::kBlock && widest_kernels() == KernelWidth::kAvx512) return kAvx512;
  // Also for smaller counts: the narrow kernel has no native fused operations.
  if (widest_kernels() >= KernelWidth::kAvx2) return kAvx2;
#endif
  static constexpr WakeKernel kNarrow = {narrow::kBlock, narrow::strengths, narrow::swarm_forces,
                                         narrow::compose_row, narrow::logarithm_of_one};
  return kNarrow;
}

}  // namespace

EffectInfo Downwash::describe() {
  return {"downwash",
          "f_z = -A (sum_j g_j^p)^(1/p), g_j = (m_j / 0.034)^e (0.3 / dz)^n (1 + q x)^(-1/q), "
          "x = |r - k dz v_j|^2 / (2 (s0 + s1 dz)^2); exp(-x) for q = 0",
          "least squares on 103 230 samples of two published Crazyflies; composition from flights of three",
          "downwash",
          "pass and stay below another vehicle, 0.2 .. 0.6 m, and fly alone in the same flights",
          {{"amplitude_N",
            "force 0.3 m straight below a vehicle of 0.034 kg",
            10.03299049 * kGramForce_N,
            0,
            2,
            {},
            Unit::kWeight}},
          {{"decay_exponent", "n", 0.44084819, 0, 4, {0.44084819, 1}},
           {"spread_m", "s0", 0.0259477, 0.005, 0.3, {0.0259477, 0.06}},
           {"spread_slope", "s1", 0.08181592, 0, 1, {0.028, 0.08181592}},
           {"norm_exponent", "p: 1 adds forces, 2 adds momentum flux", 1.3, 1, 10, {1.3, 1.85}},
           {"convection_s_m", "k: 1 / speed of the wake", 0, 0, 1, {0, 0.15}},
           {"mass_exponent", "e: 0.5 is momentum theory at equal rotor area", 0.5, 0, 2},
           {"tail", "q: 0 is a Gaussian profile, 1 a Lorentzian one", 0, 0, 1, {0, 1}}},
          false,
          true,
          {Family::kWake}};
}

void Downwash::columns(const Instant& now, const double* shape, Wrench* columns) const {
  columns_along(&now, 1, shape, columns);
}

void Downwash::columns_along(const Instant* instants, int count, const double* shape, Wrench* columns) const {
  drifted_columns(instants, count, shape, {}, columns);
}

// Uses the same arithmetic as for a whole swarm, for the pairs of several instants at a time.
void Downwash::drifted_columns(const Instant* instants, int count, const double* shape,
                               const WakeDrift& drift, Wrench* columns) const {
  constexpr int kMost = 4 * kRowLength;
  alignas(kRowLength * sizeof(double)) double rows[6][kMost], power[kMost], sums[kMost], composed[kMost];
  int of_instant[kMost], pairs = 0;
  double last_mass_kg = std::numeric_limits<double>::quiet_NaN(), last_constant = 0;
  const auto add_up = [&] {
    if (pairs == 0) return;
    for (auto& row : rows) std::fill(row + pairs, row + round_up(pairs, kRowLength), row[pairs - 1]);
    const WakeKernel& kernel = kernel_for(pairs);
    kernel.strengths({rows[0], rows[1], rows[2], rows[3], rows[4], rows[5]}, round_up(pairs, kernel.block),
                     shape, power);
    for (int k = 0; k < pairs; ++k) sums[of_instant[k]] += power[k];
    pairs = 0;
  };
  for (int first = 0; first < count; first += kMost) {
    const int some = std::min(count - first, kMost);
    std::fill(std::begin(sums), std::end(sums), 0.0);
    for (int i = 0; i < some; ++i) {
      const Instant& now = instants[first + i];
      for (int j = 0; j < now.num_neighbours; ++j) {
        const Neighbour& neighbour = now.neighbours[j];
        const Eigen::Vector3d dp_W_m = drift.dp_W_m(neighbour);
        if (dp_W_m.z() <= kWakeTouching_m) continue;  // no effect, as in the kernel
        if (pairs == kMost) add_up();
        if (neighbour.mass_kg != last_mass_kg) {
          last_mass_kg = neighbour.mass_kg;
          last_constant = pair_constant(last_mass_kg, shape);
        }
        const double numbers[] = {
            dp_W_m.x(), dp_W_m.y(), dp_W_m.z(), neighbour.v_W_m_s.x(), neighbour.v_W_m_s.y(), last_constant};
        for (int row = 0; row < 6; ++row) rows[row][pairs] = numbers[row];
        of_instant[pairs++] = i;
      }
    }
    add_up();
    const WakeKernel& kernel = kernel_for(some);
    kernel.compose_row(sums, round_up(some, kernel.block), 1 / shape[kNorm], composed);
    for (int i = 0; i < some; ++i) {
      columns[first + i] = {};
      if (sums[i] != 0) columns[first + i].force_W_N.z() = -composed[i];  // also if NaN
    }
  }
}

double Downwash::pair_constant(double neighbour_mass_kg, const double* shape) const {
  static const double log_of_reference = kernel_for(1).logarithm_of_one(kWakeReference_m);
  double of_g = shape[kDecay] * log_of_reference;
  if (neighbour_mass_kg != kWakeReferenceMass_kg) {
    of_g += shape[kMassExponent] * kernel_for(1).logarithm_of_one(neighbour_mass_kg / kWakeReferenceMass_kg);
  }
  constexpr double kLargest = 600;
  return std::min(shape[kNorm] * of_g, kLargest);
}

void Downwash::add_force_z(const SwarmPairs& pairs, const double* const* states, int num_states,
                           const double* shape, double coefficient, double* scratch,
                           const ForceRows& forces) const {
  if (pairs.empty()) return;
  kernel_for(kRowLength).swarm_forces(pairs, states, num_states, shape, coefficient, scratch, forces);
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
  // Combinations of spreads, from narrow and opening to wide and parallel; the product of all grids would have
  // thousands of columns. Refinement covers the remaining combinations.
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

std::vector<double> Downwash::bends_m() const { return {kWakeTouching_m, kWakeNearest_m}; }

double Downwash::reach_m(double dz_m, const double* shape) const {
  if (dz_m <= kWakeTouching_m) return 0;
  if (shape[kTail] > 0) return std::numeric_limits<double>::infinity();
  // The wake lags by k dz |v|; 20 m/s exceeds all flight speeds considered in this project.
  const double lag_m = shape[kConvection] * dz_m * 20;
  return kWakeReachInSpreads * (shape[kSpread0] + shape[kSpreadSlope] * std::max(dz_m, kWakeNearest_m)) +
         lag_m;
}

}  // namespace swarmcert::stability
