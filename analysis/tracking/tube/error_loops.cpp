#include "analysis/tracking/tube/error_loops.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "nn/base/interval.h"
#include "stability/bounds/sampled_loop.h"

namespace swarmcert::analysis {

namespace {

using stability::AxisLoop;
using stability::KernelCells;
using stability::Polynomial;
using stability::times_s_to;

constexpr double kUnknown = std::numeric_limits<double>::infinity();

bool same_loop(const AxisLoop& a, const AxisLoop& b) {
  return a.Kp == b.Kp && a.Kd == b.Kd && a.Ki == b.Ki && a.lags_s == b.lags_s;
}

/// A slice is a whole number of periods up to this, relatively.
constexpr double kPeriodTolerance = 1e-12;

/// Cells of |k'| for ErrorLoop::slope1 .. slope3.
/// @param more for a cell that is not quite a whole number of periods, relative to sup |k|.
std::optional<KernelCells> slope_of(const std::optional<KernelCells>& kernel,
                                    const std::optional<KernelCells>& slope, double scale, double more) {
  if (!kernel || !slope) return std::nullopt;
  KernelCells result = *slope;
  for (std::size_t n = 0; n < result.integral.size(); ++n) {
    result.integral[n] = up(up(result.integral[n] * scale) + up(more * kernel->peak));
    result.net[n] = {-result.integral[n], result.integral[n]};
  }
  result.peak = up(result.peak * scale);
  return result;
}

/// @param one_lag_s its time constant where the loop has one lag, which makes h'''' = -direct_rest/tau; else 0.
void add_slopes(double slice_s, double one_lag_s, const std::optional<KernelCells>& h4, ErrorLoop& loop) {
  const double periods = std::round(slice_s / loop.period_s);
  if (!(periods >= 1) || !(std::abs(slice_s - periods * loop.period_s) <= kPeriodTolerance * slice_s)) return;
  // What is left of a cell of P periods T is at most 1e-12 P T long, and t - t_k - T/2 there at most T/2.
  const double more = 8 * kPeriodTolerance * periods;
  loop.slope1 = slope_of(loop.h1, loop.h2, 1, more);
  loop.slope2 = slope_of(loop.h2, loop.has_lag ? loop.h3 : loop.direct_rest, 1, more);
  if (loop.has_lag) {
    loop.slope3 = one_lag_s > 0 ? slope_of(loop.h3, loop.direct_rest, up(1 / one_lag_s), more)
                                : slope_of(loop.h3, h4, 1, more);
  }
  loop.has_whole_periods = loop.slope1 && loop.slope2 && (loop.slope3 || !loop.has_lag);
}

/// @param period_s of a sampled loop; 0: continuous.
ErrorLoop error_loop(const AxisLoop& loop, double period_s, double slice_s, int slices) {
  ErrorLoop result;
  result.mass_kg = loop.mass_kg;
  result.period_s = period_s;
  result.Kp = loop.Kp;
  result.Kd = loop.Kd;
  result.Ki = loop.Ki;
  Polynomial lag = {1};
  for (const double tau : loop.lags_s) {
    if (tau <= 0) continue;
    lag = stability::product(lag, {1, tau});
    result.lags_s = up(result.lags_s + tau);
  }
  const int integrates = loop.Ki > 0 ? 1 : 0;
  const Polynomial feedback =
      integrates == 1 ? Polynomial{loop.Ki, loop.Kp, loop.Kd} : Polynomial{loop.Kp, loop.Kd};
  const Polynomial open = times_s_to(2 + integrates, lag);
  const auto cells = [&](const Polynomial& numerator) {
    return stability::kernel_cells({numerator, open, feedback, 0}, slice_s, slices);
  };
  const Polynomial unit = {1 / loop.mass_kg};
  if (integrates == 1) result.h = cells(unit);
  result.h1 = cells(times_s_to(integrates, unit));
  result.h2 = cells(times_s_to(integrates + 1, unit));
  result.has_lag = lag.size() > 1;
  if (period_s > 0) {
    Polynomial numerator = stability::scaled(feedback, 1 / loop.mass_kg);
    if (result.has_lag) numerator = stability::sum(numerator, times_s_to(2 + integrates, unit));
    result.direct_rest = cells(numerator);
    if (result.direct_rest) result.direct_rest_total = result.direct_rest->total();
  }
  if (integrates == 1) {
    Polynomial numerator = times_s_to(2, lag);
    numerator[1] += loop.Kd;
    result.demand = cells(numerator);
  }
  if (!result.has_lag) {
    if (period_s > 0) add_slopes(slice_s, 0, std::nullopt, result);
    return result;
  }
  const Polynomial rest = stability::scaled(Polynomial(lag.begin() + 1, lag.end()), 1 / loop.mass_kg);
  result.g = cells(times_s_to(integrates, rest));
  result.g1 = cells(times_s_to(integrates + 1, rest));
  result.g2 = cells(times_s_to(integrates + 2, rest));
  result.h3 = cells(times_s_to(integrates + 2, unit));
  if (period_s == 0) return result;
  if (result.h3) result.h3_total = result.h3->total();
  if (result.g2) result.g2_total = result.g2->total();
  const bool has_one_lag = lag.size() == 2;
  add_slopes(slice_s, has_one_lag ? lag[1] : 0,
             has_one_lag ? std::nullopt : cells(times_s_to(integrates + 3, unit)), result);
  return result;
}

std::vector<double> least(const std::optional<KernelCells>& by_size,
                          const std::optional<KernelCells>& by_rate, const Signal& signal) {
  std::vector<double> result(signal.size.size(), kUnknown);
  if (by_size) result = convolved(*by_size, signal.size);
  if (!by_rate || signal.rate.empty()) return result;
  const std::vector<double> other = convolved(*by_rate, signal.rate);
  const double jump = up(by_rate->peak * signal.at_start);
  for (std::size_t k = 0; k < result.size(); ++k) result[k] = std::min(result[k], up(other[k] + jump));
  return result;
}

}  // namespace

ErrorLoops error_loops(const stability::TrackingSetup& tracking, double slice_s, int slices,
                       bool is_sampled) {
  ErrorLoops loops;
  if (tracking.gains.delay_s > 0) {
    loops.refusal = "the loop has a delay, whose kernel has no enclosure: set [lag] delay_s = 0";
    return loops;
  }
  if (tracking.plant.thrust_scale != 1) {
    loops.refusal =
        "the force that acts is not the force commanded (thrust_ratio), which a tube does not follow";
    return loops;
  }
  std::optional<AxisLoop> last;
  for (int axis = 0; axis < 3; ++axis) {
    std::optional<AxisLoop> loop = axis_loop(tracking.gains, tracking.plant, axis);
    if (!loop) {
      loops.refusal = "Lambda or K couples the axes";
      return loops;
    }
    double period_s = 0;
    if (const auto sampled = sampled_axis_loop(tracking.gains, tracking.plant, axis)) {
      loop->Ki = stability::effective_Ki(*sampled);
      if (is_sampled) period_s = up(sampled->period_s);
    }
    loops.axis[axis] =
        last && same_loop(*loop, *last) ? loops.axis[axis - 1] : error_loop(*loop, period_s, slice_s, slices);
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
    // Without a term there is nothing to round.
    if (other.position_m[k] != 0) position_m[k] = up(position_m[k] + other.position_m[k]);
    if (other.velocity_m_s[k] != 0) velocity_m_s[k] = up(velocity_m_s[k] + other.velocity_m_s[k]);
  }
}

double ErrorHistory::largest_position_m() const {
  return *std::max_element(position_m.begin(), position_m.end());
}
double ErrorHistory::largest_velocity_m_s() const {
  return *std::max_element(velocity_m_s.begin(), velocity_m_s.end());
}

LagStart lag_start(const ErrorLoop& loop, double slice_s) {
  LagStart result;
  if (!loop.has_lag) return result;
  const Interval tau_s(loop.lags_s * (1 - 1e-15), loop.lags_s),
      cell_s = Interval(slice_s) * Interval(1 - 1e-12, 1 + 1e-12);
  // A kernel leaves its mean over a cell by at most the integral of its slope's absolute value there.
  const auto values = [&](const KernelCells& kernel, const KernelCells& slope, Interval slope_scale = 1) {
    std::vector<Interval> of_cell;
    for (std::size_t n = 0; n < kernel.net.size(); ++n) {
      const double away = (slope_scale * slope.integral[n]).upper;
      of_cell.push_back(tau_s * (kernel.net[n] / cell_s + Interval(-away, away)));
    }
    return of_cell;
  };
  result.position_m = values(*loop.h1, *loop.h2);
  result.velocity_m_s = values(*loop.h2, *loop.h3);
  // With one lag h'''' = -direct_rest/tau.
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
  // Without a lag e'' follows a force at once, and then feeds back.
  result.acceleration_m_s2 = of(loop.has_lag ? loop.h3 : loop.direct_rest, result.force_N);
  const double at_once_m_s2 = loop.has_lag ? 0 : (Interval(result.force_N) / loop.mass_kg).upper;
  const std::vector<double> integrated = of(loop.h2, integrated_N);
  for (std::size_t n = 0; n < slices; ++n)
    result.acceleration_m_s2[n] = up(up(result.acceleration_m_s2[n] + integrated[n]) + at_once_m_s2);
  return result;
}

ErrorHistory respond(const ErrorLoop& loop, bool lagging, const Signal& signal) {
  if (lagging && !loop.has_lag) {
    return {std::vector<double>(signal.size.size(), 0.0), std::vector<double>(signal.size.size(), 0.0)};
  }
  if (lagging) return {least(loop.g1, loop.g, signal), least(loop.g2, loop.g1, signal)};
  return {least(loop.h1, loop.h, signal), least(loop.h2, loop.h1, signal)};
}

}  // namespace swarmcert::analysis
