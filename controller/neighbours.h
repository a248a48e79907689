/// @file From neighbours' radio positions to the predicted force f_a_hat: tracks, fading cut-offs, the deep set.
///
/// Every result is a function of the set of neighbours and bitwise independent of their order.
#pragma once

#include <cstdint>
#include <initializer_list>

#include "controller/linear_algebra.h"
#include "nn/deep_set.h"

namespace swarmcert::controller {

/// Maximum age of a neighbour's state, in milliseconds; after that the downwash has moved on.
inline constexpr std::uint32_t kMaxNeighbourAge_ms = 500;

/// Returns the milliseconds from `stamp_ms` to `now_ms` on a counter that wraps around; 0 for stamps that appear to be
/// in the future, which occur when a radio task runs between two readings of the clock.
inline std::uint32_t age_ms(std::uint32_t now_ms, std::uint32_t stamp_ms) {
  const std::uint32_t age = now_ms - stamp_ms;
  return age < 0x80000000u ? age : 0;
}

/// Estimated state of one neighbour. Positions are received; velocities are estimated from them.
template <typename Scalar>
struct NeighbourTrack {
  Vector3<Scalar> position_W_m;
  Vector3<Scalar> velocity_W_m_s;
  std::uint32_t stamp_ms = 0;           ///< of the position
  std::uint32_t velocity_since_ms = 0;  ///< when a velocity first became available
  int kind = 0;                         ///< index into DeepSet::phi
  bool has_position = false;
  bool has_velocity = false;
};

/// v <- smoothing v + (1 - smoothing) (p_new - p_old) / dt, with each difference quotient clamped to +-largest_m_s.
template <typename Scalar>
struct VelocityFilter {
  Scalar smoothing = Scalar(0.8);    ///< in [0, 1)
  Scalar largest_m_s = Scalar(2.0);  ///< limits jumps of the position due to a lost marker
};

/// Result of processing a new position.
enum class TrackStatus : std::uint8_t {
  kUpdated,
  kStarted,    ///< the first position, or the first after more than kMaxNeighbourAge_ms: no velocity yet
  kRepeated,   ///< not newer than the last: ignored
  kNotFinite,  ///< ignored
  kOutOfRange  ///< further than kFarthestPosition_m from the origin: ignored
};

/// Positions beyond this limit are invalid.
inline constexpr int kFarthestPosition_m = 1000;

/// Updates the track with a position measured at `stamp_ms`.
template <typename Scalar>
inline TrackStatus update(NeighbourTrack<Scalar>& track, const VelocityFilter<Scalar>& filter,
                          const Vector3<Scalar>& position_W_m, std::uint32_t stamp_ms) {
  if (!is_finite(position_W_m)) return TrackStatus::kNotFinite;
  if (!is_within(position_W_m, Scalar(kFarthestPosition_m))) return TrackStatus::kOutOfRange;
  const std::uint32_t gap_ms = age_ms(stamp_ms, track.stamp_ms);
  if (track.has_position && gap_ms == 0) return TrackStatus::kRepeated;
  const Vector3<Scalar> moved = position_W_m - track.position_W_m;
  const bool continues = track.has_position && gap_ms <= kMaxNeighbourAge_ms;
  track.position_W_m = position_W_m;
  track.stamp_ms = stamp_ms;
  track.has_position = true;
  if (!continues) {
    track.has_velocity = false;
    track.velocity_W_m_s = {};
    return TrackStatus::kStarted;
  }
  const Scalar step_s = static_cast<Scalar>(gap_ms) / Scalar(1000);
  const Scalar limit = filter.largest_m_s;
  const auto held = [&](const Scalar& v) { return clamp(v / step_s, -limit, limit); };
  const Vector3<Scalar> raw{held(moved.x), held(moved.y), held(moved.z)};
  if (!track.has_velocity) {
    track.velocity_since_ms = stamp_ms;
    track.velocity_W_m_s = raw;
    track.has_velocity = true;
  } else {
    track.velocity_W_m_s =
        scaled(filter.smoothing, track.velocity_W_m_s) + scaled(Scalar(1) - filter.smoothing, raw);
  }
  return TrackStatus::kUpdated;
}

/// Which neighbours are taken into account: those with a known velocity and a recent position whose relative position
/// p_j - p_i, in W, is within a box. A neighbour's weight decreases linearly to 0 over fade_m towards each face of the
/// box and over fade_ms towards kMaxNeighbourAge_ms, and increases over fade_ms from the time its velocity becomes
/// known; the smallest of these weights applies. A fade of 0 makes that cut-off hard.
template <typename Scalar>
struct CutOffs {
  Vector3<Scalar> lower_m{Scalar(-1), Scalar(-1), Scalar(-1)};
  Vector3<Scalar> upper_m{Scalar(1), Scalar(1), Scalar(1)};
  Scalar fade_m = Scalar(0.1);
  std::uint32_t fade_ms = 100;
};

namespace detail {

/// Returns min(inside / fade, 1), at least 0; with fade 0, returns 1 if `inside` is positive, else 0.
template <typename Scalar>
inline Scalar ramp(const Scalar& inside, const Scalar& fade) {
  if (!(inside > Scalar(0))) return Scalar(0);
  return inside < fade ? inside / fade : Scalar(1);
}

template <typename Scalar>
inline Scalar least(const Scalar& a, const Scalar& b) {
  return b < a ? b : a;
}

}  // namespace detail

/// Returns the weight in [0, 1] of a neighbour as defined by CutOffs.
template <typename Scalar>
inline Scalar weight(const NeighbourTrack<Scalar>& track, const CutOffs<Scalar>& cut_offs,
                     const Vector3<Scalar>& own_position_W_m, std::uint32_t now_ms) {
  const std::uint32_t age = age_ms(now_ms, track.stamp_ms);
  if (!track.has_velocity || age >= kMaxNeighbourAge_ms) return Scalar(0);
  const auto fade_ms = static_cast<Scalar>(cut_offs.fade_ms);
  const auto left_ms = static_cast<Scalar>(kMaxNeighbourAge_ms - age);
  // One more than the age of the velocity, so that with a hard cut-off a neighbour counts immediately.
  const auto known_ms = static_cast<Scalar>(age_ms(now_ms, track.velocity_since_ms)) + Scalar(1);
  Scalar w = detail::least(detail::ramp(left_ms, fade_ms), detail::ramp(known_ms, fade_ms));
  const Vector3<Scalar> p = track.position_W_m - own_position_W_m;
  const Vector3<Scalar> above = p - cut_offs.lower_m, below = cut_offs.upper_m - p;
  for (const Scalar& inside : {above.x, above.y, above.z, below.x, below.y, below.z}) {
    w = detail::least(w, detail::ramp(inside, cut_offs.fade_m));
  }
  return w;
}

inline constexpr int kMostNeighbours = 10;
inline constexpr int kNeighbourInputs = 6;  ///< p_j - p_i in m, then v_j - v_i in m/s, in W
inline constexpr int kOwnInputs = 4;        ///< of the ground term: own -z in m, own -v in m/s, in W

/// How the output of a deep set is converted to a force.
template <typename Scalar>
struct PredictionSettings {
  CutOffs<Scalar> cut_offs;
  Scalar newton_per_unit = Scalar(9.81e-3);  ///< unit of the network's output; here gram-force
  Scalar largest_force_N = Scalar(0.2);      ///< limit on |f_a_hat|, whatever the network predicts
};

/// Result of a prediction: success or the reason for failure.
enum class PredictionStatus : std::uint8_t {
  kOk,
  kTooManyNeighbours,  ///< more than kMostNeighbours: f_a_hat = 0
  kOwnStateInvalid,    ///< not finite, or out of range: f_a_hat = 0
  kNetworkFailed,      ///< see Prediction::network: f_a_hat = 0
  kWrongNetwork        ///< wrong number of inputs or outputs: f_a_hat = 0
};

template <typename Scalar>
struct Prediction {
  Vector3<Scalar>
      effect_W_N;  ///< f_a_hat; zero unless the status is kOk, so that a failure means no compensation
  PredictionStatus status = PredictionStatus::kOk;
  nn::DeepSetStatus network = nn::DeepSetStatus::kOk;
  int used = 0;     ///< neighbours with weight 1
  int fading = 0;   ///< neighbours with a weight between 0 and 1
  Scalar jump_N{};  ///< |f_a_hat - previous|: the step that the controller sees
};

namespace detail {

/// @param evaluate see predict_with().
template <typename Scalar, typename Evaluate>
inline Prediction<Scalar> predict_from_zero(const Evaluate& evaluate,
                                            const PredictionSettings<Scalar>& settings,
                                            const Vector3<Scalar>& own_position_W_m,
                                            const Vector3<Scalar>& own_velocity_W_m_s,
                                            const NeighbourTrack<Scalar>* tracks, int num_tracks,
                                            std::uint32_t now_ms) {
  Prediction<Scalar> result;
  const auto failed = [&](PredictionStatus status) {
    result.status = status;
    return result;
  };
  if (num_tracks < 0 || num_tracks > kMostNeighbours) return failed(PredictionStatus::kTooManyNeighbours);
  if (!is_within(own_position_W_m, Scalar(kFarthestPosition_m)) || !is_finite(own_velocity_W_m_s)) {
    return failed(PredictionStatus::kOwnStateInvalid);
  }
  Scalar weights[kMostNeighbours], inputs[kMostNeighbours][kNeighbourInputs];
  for (int j = 0; j < num_tracks; ++j) {
    weights[j] = weight(tracks[j], settings.cut_offs, own_position_W_m, now_ms);
    if (weights[j] > Scalar(0)) ++(weights[j] < Scalar(1) ? result.fading : result.used);
    const Vector3<Scalar> p = tracks[j].position_W_m - own_position_W_m;
    const Vector3<Scalar> v = tracks[j].velocity_W_m_s - own_velocity_W_m_s;
    Scalar* const x = inputs[j];
    x[0] = p.x, x[1] = p.y, x[2] = p.z, x[3] = v.x, x[4] = v.y, x[5] = v.z;
  }
  const Scalar own[kOwnInputs] = {-own_position_W_m.z, -own_velocity_W_m_s.x, -own_velocity_W_m_s.y,
                                  -own_velocity_W_m_s.z};

  Scalar sum(0), level(1);
  for (;;) {
    nn::Neighbour<Scalar> present[kMostNeighbours];
    int count = 0;
    Scalar next(0);
    for (int j = 0; j < num_tracks; ++j) {
      if (weights[j] >= level) {
        present[count++] = {inputs[j], tracks[j].kind};
      } else if (weights[j] > next) {
        next = weights[j];
      }
    }
    Scalar output(0);
    result.network = evaluate(own, present, count, &output);
    if (result.network != nn::DeepSetStatus::kOk) return failed(PredictionStatus::kNetworkFailed);
    sum = sum + product(level - next, output);
    if (!(next > Scalar(0))) break;
    level = next;
  }
  const Scalar limit = settings.largest_force_N;
  result.effect_W_N.z = clamp(product(settings.newton_per_unit, sum), -limit, limit);
  return result;
}

}  // namespace detail

/// Computes f_a_hat from the tracks, in any order.
///
/// If all weights are 0 or 1, this is the deep set of the neighbours with weight 1. Otherwise it is
///   f = (1 - w_1) F(N_0) + (w_1 - w_2) F(N_1) + ... + w_k F(N_k),   1 > w_1 > ... > w_k > 0,
/// where N_i contains the neighbours with weight at least w_i and N_0 those with weight 1 (the Lovasz extension of the
/// set function F). This is a convex combination of values of F, so every bound on the range of F holds. It is
/// continuous in the weights; while a weight w changes, f changes at a rate of at most |w'| times the change of F due
/// to that neighbour. If that neighbour makes the composition silent or stops it from being so, the change of F is all
/// of F, whose size no certificate of the set states; it is limited by largest_force_N. Each distinct weight costs one
/// more evaluation of the set.
///
/// @param evaluate (own, neighbours, number of them, output) -> nn::DeepSetStatus: the network F for some of the
///     neighbours. Every evaluation of a vehicle goes through it, so that what is tested is what flies.
/// @param previous_W_N f_a_hat of the previous execution, for Prediction::jump_N.
template <typename Scalar, typename Evaluate>
inline Prediction<Scalar> predict_with(const Evaluate& evaluate, const PredictionSettings<Scalar>& settings,
                                       const Vector3<Scalar>& own_position_W_m,
                                       const Vector3<Scalar>& own_velocity_W_m_s,
                                       const NeighbourTrack<Scalar>* tracks, int num_tracks,
                                       std::uint32_t now_ms, const Vector3<Scalar>& previous_W_N) {
  Prediction<Scalar> result = detail::predict_from_zero(evaluate, settings, own_position_W_m,
                                                        own_velocity_W_m_s, tracks, num_tracks, now_ms);
  result.jump_N = norm(result.effect_W_N - previous_W_N);
  return result;
}

/// The same for the deep set `set`; PredictionStatus::kWrongNetwork unless its inputs and outputs are those of F.
template <typename Scalar>
inline Prediction<Scalar> predict(const nn::DeepSet<Scalar>& set, const PredictionSettings<Scalar>& settings,
                                  const Vector3<Scalar>& own_position_W_m,
                                  const Vector3<Scalar>& own_velocity_W_m_s,
                                  const NeighbourTrack<Scalar>* tracks, int num_tracks, std::uint32_t now_ms,
                                  const Vector3<Scalar>& previous_W_N,
                                  const nn::DeepSetWorkspace<Scalar>& workspace) {
  const bool fits = set.inputs() == kNeighbourInputs && set.outputs() == 1 &&
                    (set.ground == nullptr || set.own_inputs() == kOwnInputs);
  if (!fits) {
    Prediction<Scalar> result;
    result.status = PredictionStatus::kWrongNetwork;
    result.jump_N = norm(previous_W_N);
    return result;
  }
  const auto evaluate = [&](const Scalar* own, const nn::Neighbour<Scalar>* present, int count,
                            Scalar* output) {
    return nn::evaluate(set, own, present, count, output, workspace);
  };
  return predict_with(evaluate, settings, own_position_W_m, own_velocity_W_m_s, tracks, num_tracks, now_ms,
                      previous_W_N);
}

}  // namespace swarmcert::controller
