#include "analysis/tracking/tube/error_loops.h"

#include <algorithm>
#include <cmath>

#include "nn/base/interval.h"
#include "stability/bounds/enclosures/lag_range_cells.h"
#include "stability/bounds/loops/sampled_loop.h"

namespace swarmcert::analysis {

namespace {

using stability::AxisLoop;
using stability::IntervalVector;
using stability::KernelCells;

/// Relative tolerance for a slice to count as an integer number of periods.
constexpr double kPeriodTolerance = 1e-12;

/// Cells of |k'| for ErrorLoop::slope1 .. slope3.
/// @param more allowance for a cell that deviates from an integer number of periods, relative to sup |k|.
std::optional<KernelCells> slope_of(const std::optional<KernelCells>& kernel,
                                    const std::optional<KernelCells>& slope, double scale, double more) {
  if (!kernel || !slope) return std::nullopt;
  KernelCells result = *slope;
  for (std::size_t n = 0; n < result.integral.size(); ++n) {
    result.integral[n] = up(up(result.integral[n] * scale) + up(more * kernel->peak));
    result.net[n] = {-result.integral[n], result.integral[n]};
  }
  result.modes.clear();
  result.peak = up(result.peak * scale);
  return result;
}

/// @param h4 missing if the loop has a single lag, where it equals -direct_rest/tau.
void add_slopes(double slice_s, const std::optional<KernelCells>& h4, ErrorLoop& loop) {
  const double periods = std::round(slice_s / loop.period_s);
  if (!(periods >= 1) || !(std::abs(slice_s - periods * loop.period_s) <= kPeriodTolerance * slice_s)) return;
  // A cell of P periods T leaves a remainder of length at most 1e-12 P T, in which t - t_k - T/2 is at most T/2.
  const double more = 8 * kPeriodTolerance * periods;
  loop.slope1 = slope_of(loop.h1, loop.h2, 1, more);
  loop.slope2 = slope_of(loop.h2, loop.has_lag ? loop.h3 : loop.direct_rest, 1, more);
  if (loop.has_lag) {
    loop.slope3 = h4 ? slope_of(loop.h3, h4, 1, more)
                     : slope_of(loop.h3, loop.direct_rest, up(1 / loop.lags_s.lower), more);
  }
  loop.has_whole_periods = loop.slope1 && loop.slope2 && (loop.slope3 || !loop.has_lag);
}

/// p with every coefficient multiplied by `factor`, times s^power.
IntervalVector times(Interval factor, const IntervalVector& p, int power = 0) {
  IntervalVector result(static_cast<std::size_t>(power));
  for (const Interval& c : p) result.push_back(factor * c);
  return result;
}

IntervalVector sum(IntervalVector a, const IntervalVector& b) {
  a.resize(std::max(a.size(), b.size()));
  for (std::size_t i = 0; i < b.size(); ++i) a[i] += b[i];
  return a;
}

/// Kernels of the loop for motor lags tau in an interval. With the other lag A, L = A + tau s A and
///   D = d + tau d',   d = s^(2 + i) A + P,   d' = s^(3 + i) A,   where i = 1 for Ki > 0, else 0, and P includes s^i.
class LoopKernels {
 public:
  LoopKernels(const AxisLoop& loop, Interval motor_lag_s, double slice_s, int slices)
      : integrates_(loop.Ki > 0 ? 1 : 0),
        motor_lag_s_(motor_lag_s),
        inverse_mass_(Interval(1) / loop.mass_kg),
        other_lag_{Interval(1)},
        feedback_(integrates_ == 1 ? IntervalVector{loop.Ki, loop.Kp, loop.Kd}
                                   : IntervalVector{loop.Kp, loop.Kd}),
        Kd_(loop.Kd) {
    if (motor_lag_s.upper > 0) motor_ = {1};
    for (const double tau_s : loop.lags_s) other_lag_ = sum(other_lag_, times(tau_s, other_lag_, 1));
    cells_.emplace(sum(times(1, other_lag_, 2 + integrates_), feedback_), by_motor(1, 3 + integrates_),
                   motor_lag_s, slice_s, slices);
  }

  /// L^-1[s^power/(m D)] with the D of this class: h' has power i.
  std::optional<KernelCells> h(int power) const { return cells_->cells(times(inverse_mass_, {1}, power)); }
  /// L^-1[s^power (L - 1)/(s m D)]: g has power i.
  std::optional<KernelCells> g(int power) const {
    const IntervalVector other(other_lag_.begin() + 1, other_lag_.end());  // (A - 1)/s
    const IntervalVector fixed = other.empty() ? IntervalVector() : times(inverse_mass_, other, power);
    return cells_->cells(fixed, by_motor(inverse_mass_, power));
  }
  std::optional<KernelCells> direct_rest(bool has_lag) const {
    IntervalVector numerator = times(inverse_mass_, feedback_);
    if (has_lag) numerator = sum(numerator, times(inverse_mass_, {1}, 2 + integrates_));
    return cells_->cells(numerator);
  }
  std::optional<KernelCells> demand() const {
    return cells_->cells(sum(times(1, other_lag_, 2), {0, Kd_}), by_motor(1, 3));
  }

 private:
  /// factor s^power A; empty if the motors have no lag.
  IntervalVector by_motor(Interval factor, int power) const {
    return motor_.empty() ? IntervalVector() : times(factor, other_lag_, power);
  }

  int integrates_;
  Interval motor_lag_s_, inverse_mass_;
  IntervalVector other_lag_, feedback_, motor_;
  Interval Kd_;
  std::optional<stability::LagRangeCells> cells_;
};

/// @param loop its lags are those of the attitude.
/// @param period_s period of a sampled loop; 0: continuous
ErrorLoop error_loop(const AxisLoop& loop, Interval motor_lag_s, double period_s, double slice_s,
                     int slices) {
  ErrorLoop result;
  result.mass_kg = loop.mass_kg;
  result.period_s = period_s;
  result.Kp = loop.Kp;
  result.Kd = loop.Kd;
  result.Ki = loop.Ki;
  result.lags_s = motor_lag_s;
  for (const double tau_s : loop.lags_s) result.lags_s += tau_s;
  result.has_lag = result.lags_s.upper > 0;
  const int integrates = loop.Ki > 0 ? 1 : 0;
  const LoopKernels kernels(loop, motor_lag_s, slice_s, slices);
  if (integrates == 1) result.h = kernels.h(0);
  result.h1 = kernels.h(integrates);
  result.h2 = kernels.h(integrates + 1);
  if (period_s > 0) result.direct_rest = kernels.direct_rest(result.has_lag);
  if (integrates == 1) result.demand = kernels.demand();
  if (!result.has_lag) {
    if (period_s > 0) add_slopes(slice_s, std::nullopt, result);
    return result;
  }
  result.g = kernels.g(integrates);
  result.g1 = kernels.g(integrates + 1);
  result.g2 = kernels.g(integrates + 2);
  result.h3 = kernels.h(integrates + 2);
  if (period_s == 0) return result;
  const bool has_one_lag = loop.lags_s.empty() || motor_lag_s.upper == 0;
  add_slopes(slice_s, has_one_lag ? std::nullopt : kernels.h(integrates + 3), result);
  return result;
}

}  // namespace

bool same_gains_and_lags(const AxisLoop& a, const AxisLoop& b) {
  return a.Kp == b.Kp && a.Kd == b.Kd && a.Ki == b.Ki && a.lags_s == b.lags_s;
}

ErrorLoops error_loops(const stability::FlownLoop& tracking, double slice_s, int slices, bool is_sampled,
                       const std::optional<Interval>& motor_lag_s) {
  ErrorLoops loops;
  const Interval motors_s = motor_lag_s ? *motor_lag_s : Interval(tracking.gains.motor_lag_s);
  stability::FlownLoop without_motors = tracking;
  without_motors.gains.motor_lag_s = 0;
  if (tracking.gains.delay_s > 0) {
    loops.refusal = "the loop has a delay, whose kernel has no enclosure: set [lag] delay_s = 0";
    return loops;
  }
  if (tracking.plant.thrust_scale != 1) {
    loops.refusal =
        "the force that acts is not the force commanded (thrust_ratio), which a tube does not model";
    return loops;
  }
  std::optional<AxisLoop> last;
  for (int axis = 0; axis < 3; ++axis) {
    std::optional<AxisLoop> loop = without_motors.continuous(axis);
    if (!loop) {
      loops.refusal = "Lambda or K couples the axes";
      return loops;
    }
    const double period_s = is_sampled && tracking.is_sampled() ? up(1 / tracking.gains.rate_hz) : 0;
    loops.axis[axis] = last && same_gains_and_lags(*loop, *last)
                           ? loops.axis[axis - 1]
                           : error_loop(*loop, motors_s, period_s, slice_s, slices);
    const ErrorLoop& made = loops.axis[axis];
    if (!made.h1 || !made.h2 || (made.has_lag && (!made.g1 || !made.g2 || !made.h3)) ||
        (made.period_s > 0 && !made.direct_rest)) {
      loops.refusal =
          std::string("the loop of axis ") + stability::axis_name(axis) + " is not verifiably stable";
      return loops;
    }
    last = loop;
  }
  return loops;
}

void ErrorHistory::add(const ErrorHistory& other) {
  if (position_m.empty()) {
    *this = other;
    return;
  }
  for (std::size_t k = 0; k < position_m.size(); ++k) {
    // A zero term needs no rounding.
    if (other.position_m[k] != 0) position_m[k] = up(position_m[k] + other.position_m[k]);
    if (other.velocity_m_s[k] != 0) velocity_m_s[k] = up(velocity_m_s[k] + other.velocity_m_s[k]);
  }
}

LagStart lag_start(const ErrorLoop& loop, double slice_s) {
  LagStart result;
  if (!loop.has_lag) return result;
  const Interval tau_s = loop.lags_s;
  const Interval cell_s = Interval(slice_s) * Interval(1 - 1e-12, 1 + 1e-12);
  // A kernel deviates from its mean over a cell by at most the integral of the absolute value of its derivative there.
  const auto values = [&](const KernelCells& kernel, const KernelCells& slope, Interval slope_scale = 1) {
    std::vector<Interval> of_cell;
    for (std::size_t n = 0; n < kernel.net.size(); ++n) {
      const double away = (slope_scale * slope.integral[n]).upper;
      of_cell.push_back(tau_s * (kernel.whole_net(n) / cell_s + Interval(-away, away)));
    }
    return of_cell;
  };
  result.position_m = values(*loop.h1, *loop.h2);
  result.velocity_m_s = values(*loop.h2, *loop.h3);
  // For a single lag, h'''' = -direct_rest/tau.
  if (loop.direct_rest) result.acceleration_m_s2 = values(*loop.h3, *loop.direct_rest, Interval(1) / tau_s);
  return result;
}

bool EstimateErrors::are_zero() const {
  for (int k = 0; k < 3; ++k)
    if (velocity_m_s[k] != 0 || position_m[k] != 0) return false;
  return true;
}

EstimateAnswer estimate_answer(const ErrorLoop& loop, double velocity_m_s, double position_m,
                               std::size_t slices) {
  EstimateAnswer result;
  const Interval by_position = Interval(loop.Kp) + Interval(loop.Ki) * loop.period_s;
  result.force_N =
      (Interval(loop.mass_kg) * (Interval(loop.Kd) * velocity_m_s + by_position * position_m)).upper;
  const double integrated_N = (Interval(loop.mass_kg) * loop.Ki * position_m).upper;
  const auto of = [slices](const std::optional<KernelCells>& kernel, double size) {
    return size > 0 ? convolved(*kernel, std::vector<double>(slices, size))
                    : std::vector<double>(slices, 0.0);
  };
  result.errors = {of(loop.h1, result.force_N), of(loop.h2, result.force_N)};
  result.errors.add({of(loop.h, integrated_N), of(loop.h1, integrated_N)});
  if (loop.period_s == 0) return result;
  // Without a lag, e'' follows a force at once, before feedback acts.
  result.acceleration_m_s2 = of(loop.has_lag ? loop.h3 : loop.direct_rest, result.force_N);
  const double at_once_m_s2 = loop.has_lag ? 0 : (Interval(result.force_N) / loop.mass_kg).upper;
  const std::vector<double> integrated = of(loop.h2, integrated_N);
  for (std::size_t n = 0; n < slices; ++n)
    result.acceleration_m_s2[n] = up(up(result.acceleration_m_s2[n] + integrated[n]) + at_once_m_s2);
  return result;
}

}  // namespace swarmcert::analysis
