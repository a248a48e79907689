#include "analysis/commands/bound/bound_report.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "analysis/cli/command_line.h"
#include "analysis/commands/bound/bound_output.h"
#include "analysis/commands/bound/tube_output.h"
#include "analysis/report/report.h"

namespace swarmcert::analysis {
namespace {

using namespace stability;  // NOLINT: every name below is of that library

constexpr int kSamples = 4001;
constexpr int kShown = 400;

/// Time in seconds until the slowest pole has decayed to e^-10, at most two minutes.
double horizon_s(const TransferFunction& h) {
  double slowest = 1e300;
  for (const std::complex<double>& pole : poles(sum(h.denominator, h.feedback))) {
    slowest = std::min(slowest, std::abs(pole.real()));
  }
  return std::min(120.0, 10 / slowest + 4 * h.delay_s);
}

/// Plots the theorem's transient and ball, and the errors of one axis under ramps of slope eps of either sign.
void add_theorem_plot(Report& report, const Tracking& input, const TrackingReport& tracking) {
  if (!tracking.transient || !tracking.ball_m) return;
  const std::optional<AxisLoop> loop = input.continuous(2);
  double end_s = 12 / tracking.transient->decay_1_s();
  std::vector<double> ramp;
  if (loop) {
    const TransferFunction h = step_transfer(*loop, Channel::kCommand);
    ramp = sampled_response(h, end_s / (kSamples - 1), kSamples);
    double area = 0;
    for (std::size_t i = 0; i < ramp.size(); ++i) {
      const double value = ramp[i];
      if (i > 0) area += value * end_s / (kSamples - 1);
      ramp[i] = area * tracking.transient->rate_N_s;
    }
  }
  std::string data = "# time_s transient_bound_m ball_m error_under_a_ramp_m\n";
  for (int i = 0; i < kSamples; i += (kSamples - 1) / kShown) {
    const double t_s = end_s * i / (kSamples - 1);
    data += fmt::format("{:.6g} {:.8g} {:.8g} {}\n", t_s, tracking.transient->at(t_s), *tracking.ball_m,
                        ramp.empty() ? "NaN" : fmt::format("{:.8g}", ramp[static_cast<std::size_t>(i)]));
  }
  report.figure(
      "theorem", data,
      "set xlabel 'time [s]'\nset ylabel 'error [m]'\n"
      "plot 'theorem.dat' using 1:2 with lines linewidth 2 title 'transient bound', "
      "'' using 1:3 with lines title 'ball', "
      "'' using 1:4 with lines title 'z from rest under a ramp of eps'\n",
      "The theorem's closed-form transient and its ball, for the initial error given; and the error from "
      "rest under a learning error that rises at the rate d_m for ever, the worst of its class.");
}

/// Plots the tube of |e| from rest for forces within the amplitude, and the error under the worst of these forces.
void add_tube_plot(Report& report, const Tracking& input, const Disturbance& disturbance, int axis) {
  const std::optional<AxisLoop> loop = input.continuous(axis);
  if (!loop || !is_stable(*loop) || !std::isfinite(disturbance.amplitude_N)) return;
  const TransferFunction impulse = impulse_transfer(*loop, Channel::kForce);
  const double end_s = horizon_s(impulse);
  const double step_s = end_s / (kSamples - 1);
  const std::vector<double> kernel = sampled_response(impulse, step_s, kSamples);
  const double bound = continuous_norms(*loop, Channel::kForce).amplitude * disturbance.amplitude_N;
  std::vector<double> tube(kernel.size(), 0.0);
  for (std::size_t i = 1; i < kernel.size(); ++i) {
    tube[i] =
        tube[i - 1] + (std::abs(kernel[i]) + std::abs(kernel[i - 1])) / 2 * step_s * disturbance.amplitude_N;
  }
  std::string data = "# time_s tube_m bound_m error_under_the_worst_force_m force_N\n";
  for (int k = 0; k <= kShown; ++k) {
    const auto i = static_cast<std::size_t>(k * (kSamples - 1) / kShown);
    // f(t) = E sign h'(T - t): e(t) = int h'(t - u) f(u) du.
    double error = 0;
    for (std::size_t j = 1; j <= i; ++j) {
      const double sign = kernel[kernel.size() - 1 - j] >= 0 ? 1 : -1;
      error += sign * (kernel[i - j] + kernel[i - j + 1]) / 2 * step_s;
    }
    const double force = kernel[kernel.size() - 1 - i] >= 0 ? 1 : -1;
    data += fmt::format("{:.6g} {:.8g} {:.8g} {:.8g} {:.6g}\n", static_cast<double>(i) * step_s, tube[i],
                        bound, error * disturbance.amplitude_N, force * disturbance.amplitude_N);
  }
  const std::string name = std::string("tube_") + axis_name(axis);
  report.figure(
      name, data,
      "set xlabel 'time [s]'\nset ylabel 'error [m]'\nplot '" + name +
          ".dat' using 1:2 with lines linewidth 2 title 'tube', '' using 1:(-$2) with lines "
          "linetype 1 notitle, '' using 1:3 with lines linetype 2 title 'bound at all times', '' using "
          "1:(-$3) with lines linetype 2 notitle, '' using 1:4 with lines linetype 3 title 'worst force'\n",
      fmt::format(
          "Axis {}, continuous loop, forces of at most {:.6g} N from rest: the largest possible |e| up to "
          "each time, the bound at all times, and the error under the force that is worst at the end.",
          axis_name(axis), disturbance.amplitude_N));
}

}  // namespace

std::string write_bound_report(const Tracking& input, const LoadedDisturbance& disturbance,
                               const TrackingReport& tracking, const std::optional<TaskTube>& task_tube,
                               const files::Node& result, const std::string& folder, bool overwrite) {
  Report report("Tracking bounds");
  report.made_by(command_to_copy());
  report.result(result);
  report.paragraph(fmt::format("Gains {} on model {}, {} kg. Disturbance: {}.", input.gains.path,
                               input.model.path, input.plant.mass_kg, disturbance.source.kind));
  report.heading("Theorem");
  report.paragraph(tracking.theorem.applies ? "It applies." : "It does not apply:");
  for (const std::string& why : tracking.theorem.why_not) report.paragraph(why + ".");
  if (tracking.ball_m) report.paragraph(fmt::format("Ball: {:.6g} m.", *tracking.ball_m));
  add_theorem_plot(report, input, tracking);

  report.heading("Worst error per unit of force error");
  std::vector<std::vector<std::string>> rows;
  for (const ExactGains& row : tracking.exact) {
    rows.push_back({axis_name(row.axis), name(row.channel), name(row.loop), cell(row.norms.rate),
                    cell(row.norms.amplitude), cell(row.norms.edge), cell(row.norms.impulse)});
  }
  report.table(
      {"axis", "channel", "loop", "rate, m per N/s", "amplitude, m/N", "edge, m/N", "impulse, m per N s"},
      rows);
  const auto label = [](const auto& row) {
    return fmt::format("{} {} {}", axis_name(row.axis), name(row.channel), name(row.loop));
  };
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  std::vector<Bar> gains;
  for (const ExactGains& row : tracking.exact)
    if (std::isfinite(row.norms.amplitude)) gains.push_back({label(row), row.norms.amplitude, kNone, kNone});
  report.bars("gains", gains, "peak gain [m/N]",
              "Peak gains: the largest error per newton of a force error that may change at will.");
  if (!tracking.bounds.empty()) {
    report.heading("Bounds on the error, m");
    rows.clear();
    for (const AxisBounds& row : tracking.bounds) {
      rows.push_back({axis_name(row.axis), name(row.channel), name(row.loop), cell(row.bounds.by_rate),
                      cell(row.bounds.by_amplitude), cell(row.bounds.by_edges), cell(row.bounds.by_impulse),
                      cell(row.bounds.by_both), row.clamp.never_acts ? "no" : "may",
                      cell(row.staircase_m + row.float32_m), cell(row.total_m())});
    }
    report.table({"axis", "channel", "loop", "rate", "amplitude", "edge", "impulse", "amplitude and rate",
                  "clamp acts", "staircase and float32", "total"},
                 rows);
    report.paragraph(
        "The total is the smallest bound that holds, plus the errors due to a learned force that is updated "
        "in steps and to float32 arithmetic. If the integrator's clamp may act, only bounds that allow for "
        "it hold; they are in the result, not in this table.");
    std::vector<Bar> totals;
    for (const AxisBounds& row : tracking.bounds)
      if (std::isfinite(row.total_m())) totals.push_back({label(row), row.total_m(), kNone, kNone});
    report.bars("bounds", totals, "bound on the error [m]", "The total of each row above.");
    for (int axis = 0; axis < 3; ++axis) add_tube_plot(report, input, disturbance.source.axis[axis], axis);
  }
  if (task_tube) add_plot(report, *task_tube);
  report.heading("Rests on");
  rows.clear();
  for (const Assumption& a : tracking.assumptions) rows.push_back({a.status, a.name, a.note});
  report.table({"status", "assumption", "note"}, rows);
  return report.write(folder, overwrite);
}

}  // namespace swarmcert::analysis
