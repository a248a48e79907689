#include "stability/bounds/loops/attitude_cascade.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "nn/base/doubles.h"
#include "stability/model.h"

namespace swarmcert::stability {
namespace {

/// The loop opened at the motors: open(s) + feedback(s) is its characteristic polynomial, and a delay of the motors
/// multiplies `feedback` only.
struct CutLoop {
  Polynomial lag;  ///< L N, N = rate_lag s + 1 of the measured body rate; L without attitude
  Polynomial law;  ///< ratio (Kw s^2 + (KR s + KI) N)/J without a factor s if KI = 0; 1 without attitude
  Polynomial stiffness;  ///< ratio (KR s + KI) N/J without that factor; 1 without attitude
  int inner = 0;         ///< powers of s in the open attitude loop besides L
  int outer = 2;         ///< those of the open position loop
  Polynomial pid;        ///< ratio (Kd s^2 + Kp s + Ki) without a factor s if Ki = 0

  explicit CutLoop(const Cascade& loop) : lag{1, loop.lag_s}, law{1}, stiffness{1} {
    if (!(loop.lag_s > 0)) lag = {1};
    outer = loop.Ki > 0 ? 3 : 2;
    pid = loop.Ki > 0 ? Polynomial{loop.Ki, loop.Kp, loop.Kd} : Polynomial{loop.Kp, loop.Kd};
    pid = scaled(pid, loop.ratio);
    if (!loop.attitude) return;
    const AttitudeLoop& a = *loop.attitude;
    const bool integrates = a.KI_J_s3 > 0;
    inner = integrates ? 3 : 2;
    stiffness = integrates ? Polynomial{a.KI_J_s3, a.KR_J_s2} : Polynomial{a.KR_J_s2};
    if (loop.body_rate_lag_s > 0) {
      const Polynomial rate = {1, loop.body_rate_lag_s};
      lag = product(lag, rate);
      stiffness = product(stiffness, rate);
    }
    stiffness = scaled(stiffness, loop.ratio);
    law = sum(stiffness, times_s_to(inner - 1, {loop.ratio * a.Kw_J_s}));
  }

  Polynomial open() const { return times_s_to(inner + outer, lag); }
  Polynomial feedback() const {
    const Polynomial position = product(stiffness, pid);
    return inner == 0 ? position : sum(times_s_to(outer, law), position);
  }
  /// The denominator of the transfer function from the commanded to the actual tilt.
  Polynomial attitude_denominator() const { return inner == 0 ? lag : sum(times_s_to(inner, lag), law); }
};

}  // namespace

TransferFunction cascade_transfer(const Cascade& loop, CascadeInput input) {
  const CutLoop cut(loop);
  const int position_zeros = cut.outer - 2;
  if (input == CascadeInput::kAngularAcceleration && !loop.attitude)
    throw std::invalid_argument("cascade_transfer: no attitude loop to disturb");
  Polynomial numerator = input == CascadeInput::kAcceleration ? cut.attitude_denominator()
                         : input == CascadeInput::kVelocityError
                             ? scaled(cut.stiffness, loop.ratio * loop.Kd)
                             : scaled(times_s_to(cut.inner - 2, cut.lag), kGravity_m_s2);
  return {times_s_to(position_zeros, std::move(numerator)), sum(cut.open(), cut.feedback()), {}, 0};
}

bool is_stable(const Cascade& loop) { return is_stable(cascade_transfer(loop, CascadeInput::kAcceleration)); }

namespace {

/// Returns the factor at which stability ends, between a stable and an unstable one.
double boundary(const std::function<bool(double)>& holds, double stable, double unstable) {
  for (int i = 0; i < 60; ++i) {
    const double middle = std::sqrt(stable * unstable);
    (holds(middle) ? stable : unstable) = middle;
  }
  return stable;
}

}  // namespace

void set_gain_margins(const std::function<bool(double)>& holds, CascadeMargins& margins) {
  constexpr double kFurthest = 1e4, kStep = 1.05;
  double up = kStep, down = 1 / kStep;
  while (up < kFurthest && holds(up)) up *= kStep;
  margins.gain = up < kFurthest ? boundary(holds, up / kStep, up) : kInfinity;
  while (down > 1 / kFurthest && holds(down)) down /= kStep;
  margins.low_gain = down > 1 / kFurthest ? boundary(holds, down * kStep, down) : 0;
}

void set_damping(const std::vector<std::complex<double>>& of_poles, CascadeMargins& margins) {
  margins.damping = 1;
  for (const std::complex<double>& pole : of_poles) {
    if (pole.imag() == 0) continue;
    const double damping = -pole.real() / std::abs(pole);
    if (damping >= margins.damping) continue;
    margins.damping = damping;
    margins.frequency_rad_s = std::abs(pole);
  }
}

CascadeMargins cascade_margins(const Cascade& loop) {
  CascadeMargins margins;
  if (!is_stable(loop)) return margins;
  const auto holds = [&loop](double factor) {
    Cascade changed = loop;
    changed.ratio *= factor;
    return is_stable(changed);
  };
  set_gain_margins(holds, margins);
  const CutLoop cut(loop);
  margins.delay_s = delay_margin(cut.open(), cut.feedback());
  set_damping(poles(sum(cut.open(), cut.feedback())), margins);
  return margins;
}

Nearness nearness_to_limit_cycle(const CascadeMargins& margins) {
  if (margins.gain == 0) return Nearness::kUnstable;
  return margins.gain < kLeastGainMargin || margins.damping < kLeastDamping ? Nearness::kClose
                                                                            : Nearness::kClear;
}

const char* name(Nearness nearness) {
  return nearness == Nearness::kClear   ? "clear"
         : nearness == Nearness::kClose ? "close to a limit cycle"
                                        : "unstable";
}

}  // namespace swarmcert::stability
