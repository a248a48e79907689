#include "analysis/commands/bound/bound_output.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

namespace swarmcert::analysis {
namespace {

using namespace stability;  // NOLINT: every name below is of that library

/// What every total is subject to; nothing if it is proved.
std::optional<std::string> condition(const TrackingReport& report) {
  const Saturation& thrust = report.saturation;
  if (thrust.is_proved()) return std::nullopt;
  return std::string("the thrust does not saturate, which is ") + name(thrust.verdict) + ": " + thrust.why;
}

/// Name of the bound that row.least() returns.
std::string smallest(const AxisBounds& row) {
  if (row.least() == row.bounds.least() && row.clamp.never_acts) return row.bounds.which();
  if (!std::isfinite(row.least())) return "none";
  return row.clamp.by_amplitude < row.clamp.by_impulse ? "amplitude with clamp" : "impulse with clamp";
}

/// Axes that Lambda or K couples to other axes; they have no loops of their own and therefore no rows.
std::vector<std::string> coupled_axes(const TrackingReport& report) {
  std::vector<std::string> names;
  for (int axis = 0; axis < 3; ++axis) {
    const auto is_this = [axis](const AxisFacts& f) { return f.axis == axis; };
    if (std::none_of(report.facts.begin(), report.facts.end(), is_this)) names.push_back(axis_name(axis));
  }
  return names;
}

/// The bound from the vector gain and the rate, if the loop of the theorem is the one that flies.
std::optional<double> vector_error_m(const DisturbanceSource& source, const TrackingReport& report) {
  if (!report.ball_m || !report.vector || !report.saturation.is_proved()) return std::nullopt;
  return report.vector->upper * source.rate_norm_N_s;
}

void describe_theorem(files::Record& record, const TrackingReport& report) {
  const Theorem& theorem = report.theorem;
  const auto of_gains = [&theorem](double x) { return theorem.composite ? std::optional(x) : std::nullopt; };
  record.field("applies", theorem.applies, "Whether all its hypotheses hold.");
  record.field("why_not", theorem.why_not, "One sentence for each that fails.");
  record.field("ball", report.ball_m,
               "Of the continuous loop in the long run; null: it does not apply, or the rate is unknown.",
               "m", "upper bound");
  record.field("ball_of_flown_loop", report.flown_ball_m,
               "The same for the loop that flies, sampled if it has a rate; null: not known.", "m",
               "upper bound");
  record.constant("ball_unit", "m", "");
  record.field("ball_per_rate", of_gains(theorem.ball_per_rate()), "", "m per N/s",
               "upper bound if it applies");
  record.field("lambda_min_Lambda", of_gains(theorem.min_Lambda), "", "1/s");
  record.field("lambda_min_K", of_gains(theorem.min_K), "", "kg/s");
  const bool has_transient = theorem.composite && report.transient;
  const Transient transient = has_transient ? *report.transient : Transient{1, 1, 1, 0, 0, 0, 0};
  std::vector<ErrorAtTime> at;
  for (const double t_s : {0.0, 0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0}) at.push_back({t_s, transient.at(t_s)});
  record.object_or_null(has_transient, "transient", "The closed-form bound at all times.",
                        [&](files::Record& r) {
                          r.field("decay_1_s", transient.decay_1_s(), "", "1/s");
                          r.field("s_dot_m_s2", transient.s_dot_m_s2, "|s'| at t = 0.", "m/s^2");
                          r.field("rate_N_s", transient.rate_N_s, "d_m.", "N/s");
                          r.field("valid", theorem.applies, "Whether it holds.");
                          r.field("bound", at, "");
                        });
}

/// Gains of one loop from a force error or an error of an estimate.
struct GainRow {
  int axis = 0;
  const char* channel = "";
  Loop loop = Loop::kContinuous;
  GainNorms norms, all_times;
};

std::vector<GainRow> gain_rows(const TrackingReport& report) {
  std::vector<GainRow> rows;
  for (const ExactGains& row : report.exact)
    rows.push_back({row.axis, name(row.channel), row.loop, row.norms, row.all_times});
  for (const EstimateGains& row : report.of_estimates)
    rows.push_back({row.axis, name(row.estimate), row.loop, row.norms, row.all_times});
  return rows;
}

void describe_gain_row(files::Record& record, const GainRow& row) {
  record.field("axis", axis_name(row.axis), "");
  record.field("channel", row.channel,
               "force, command, or velocity and position for errors of these estimates, whose gains are per "
               "m/s and m.");
  record.field("loop", name(row.loop), "continuous or sampled.");
  describe_norms(record, row.norms);
  record.may_object(row.loop == Loop::kSampled, "between_samples", "The same at all times.",
                    [&row](files::Record& r) { describe_norms(r, row.all_times); });
}

void describe_axis_bounds(files::Record& record, const AxisBounds& row, const TrackingResult& result) {
  const auto bound = [&record](const char* name, double x_m, const char* meaning) {
    record.field(name, x_m, meaning, "m", "upper bound");
  };
  const DisturbanceBounds& b = row.bounds;
  record.field("axis", axis_name(row.axis), "");
  record.field("channel", name(row.channel), "force or command: where the force error enters.");
  record.field("loop", name(row.loop), "continuous or sampled.");
  record.constant("unit", "m", "");
  bound("rate", b.by_rate, "By the bound on the rate; null: not bounded.");
  bound("amplitude", b.by_amplitude, "By the bound on the force.");
  bound("edge", b.by_edges, "By the total variation.");
  bound("impulse", b.by_impulse, "By the impulse of every pass.");
  bound("amplitude_and_rate", b.by_both, "By both.");
  record.field("integrator_demand_m_s", row.clamp.demand_m_s, "Largest state that is demanded.", "m s");
  record.field("clamp_never_acts", row.clamp.never_acts,
               "Otherwise the five above hold for the linear loop only.");
  bound("amplitude_with_clamp", row.clamp.by_amplitude, "Holds though the clamp may act.");
  bound("impulse_with_clamp", row.clamp.by_impulse, "Likewise.");
  bound("minimum", row.least(), "The smallest that holds.");
  record.constant("guarantee", "bound", "");
  record.field("condition", condition(result.report), "What the totals are subject to; null: proved.");
  record.field("smallest", smallest(row), "Name of the smallest.");
  record.object("parts", "Contained in every bound.", [&row](files::Record& r) {
    r.field("bias", row.parts.bias_m, "", "m");
    r.field("initial", row.parts.initial_m, "", "m");
    r.field("velocity_error", row.parts.velocity_error_m, "", "m");
    r.field("position_error", row.parts.position_error_m, "", "m");
    r.field("reference", row.parts.reference_m, "", "m");
    r.field("thrust_ratio", row.parts.thrust_ratio_m, "", "m");
  });
  bound("staircase", row.staircase_m, "Added for a learned force that is updated in steps.");
  bound("float32", row.float32_m, "Added for float32 arithmetic; null: not bounded.");
  bound("total", row.total_m(), "With every declared part.");
  const bool is_of_network = result.source.kind == "rate of f_hat";
  record.may("of", is_of_network ? std::optional(result.source.kind) : std::nullopt,
             "The learned force alone is bounded, not its error.");
}

void describe_facts(files::Record& record, const AxisFacts& f) {
  record.field("axis", axis_name(f.axis), "");
  record.field("stable", f.stable, "");
  record.field("spectral_radius", f.spectral_radius > 0 ? std::optional(f.spectral_radius) : std::nullopt,
               "Of the sampled loop; null: the loop is not sampled.");
  record.field("lag_limit_s", f.lag_limit_s, "Further lag that the loop tolerates; null: any.", "s");
  record.field("delay_limit_s", f.delay_limit_s, "Likewise delay.", "s");
  record.field("lag_floor_rate", f.lag_floor.rate, "Gain that remains, whatever the gains, for this lag.",
               "m per N/s", "lower bound");
  record.field("lag_floor_impulse", f.lag_floor.impulse, "Likewise.", "m per N s", "lower bound");
  record.field("effort_gain", f.effort_gain, "Largest commanded force per force error.", "N/N");
  record.field("written_Ki", f.written_Ki, "As gains.toml states it.", "1/s^3");
  record.field("effective_Ki", f.effective_Ki, "As it acts, with the integrator's step.", "1/s^3");
  record.field("integral_authority_N", f.clamp_authority_N,
               "Constant force that the integrator cancels; null: any.", "N");
  record.field("clamp_residual_m", f.clamp_residual_m, "Error due to the bias that the clamp leaves.", "m");
  record.field("noise_error_m", f.noise.error_m, "Standard deviation for 1 mm and 0.05 m/s of noise.", "m");
  record.field("noise_command_m_s2", f.noise.command_m_s2, "Likewise of the command.", "m/s^2");
}

/// A stated error of an estimate along one axis.
struct EstimateRow {
  int axis = 0;
  Estimate estimate = Estimate::kVelocity;
  EstimateError error;
};

std::vector<EstimateRow> estimate_rows(const DisturbanceSource& source) {
  std::vector<EstimateRow> rows;
  for (int axis = 0; axis < 3; ++axis) {
    for (const Estimate estimate : {Estimate::kVelocity, Estimate::kPosition}) {
      const EstimateError& error =
          estimate == Estimate::kVelocity ? source.velocity_error[axis] : source.position_error[axis];
      if (!error.is_zero()) rows.push_back({axis, estimate, error});
    }
  }
  return rows;
}

std::array<double, 3> amplitudes(const EstimateError (&errors)[3]) {
  return {errors[0].amplitude, errors[1].amplitude, errors[2].amplitude};
}

void describe_disturbance_source(files::Record& record, const DisturbanceSource& source) {
  record.field("source", source.kind, "declared, declared truth, measured, rate of f_hat, or none.");
  record.field("f_hat_rate_N_s",
               source.f_hat_rate_known ? std::optional(source.f_hat_rate_N_s) : std::nullopt,
               "Of the learned force; null: not known.", "N/s", "upper bound");
  record.field("bias_N", std::array<double, 3>{source.bias_N[0], source.bias_N[1], source.bias_N[2]}, "",
               "N");
  record.field("velocity_error_m_s", amplitudes(source.velocity_error),
               "Estimated minus true; null: not bounded.", "m/s", "upper bound");
  record.field("thrust_ratio_error", source.thrust_ratio_error,
               "Largest |d|, where (1 + d) times the modelled thrust acts.");
  record.field("position_error_m", amplitudes(source.position_error), "Estimated minus true.", "m",
               "upper bound");
  record.list("of_estimates", estimate_rows(source), "Stated errors of the estimates, null: not bounded.",
              [](files::Record& r, const EstimateRow& row) {
                const EstimateError& error = row.error;
                r.field("axis", axis_name(row.axis), "");
                r.field("channel", name(row.estimate), "velocity or position.");
                r.field("unit", row.estimate == Estimate::kVelocity ? "m/s" : "m", "Of the amplitude.");
                r.field("amplitude", error.amplitude, "");
                r.field("rate_per_s", error.rate, "");
                r.field("variation", error.variation, "");
                r.field("impulse_s", error.impulse, "");
                r.field("constant", error.constant, "");
                r.field("window_s", error.window_s > 0 ? std::optional(error.window_s) : std::nullopt,
                        "Over which it was measured; null: at all times.", "s");
              });
}

void describe_thrust(files::Record& record, const Saturation& thrust) {
  record.field("verdict", name(thrust.verdict),
               "proved, refuted or undecided: no declared input saturates it.");
  record.field("why", thrust.why, "The counterexample, or what is missing.");
  record.field("feedback_N", thrust.feedback_N, "Largest commanded force beside the weight, per axis.", "N",
               "upper bound");
  record.field("least_N", thrust.least_N, "Smallest vertical force that may be commanded.", "N",
               "lower bound");
  record.field("most_N", thrust.most_N, "Largest collective force that may be commanded.", "N",
               "upper bound");
  record.field("available_N", thrust.available_N, "Smallest and largest force of all rotors.", "N");
  record.field("tilt_rad", thrust.tilt_rad(), "Of the commanded force.", "rad", "upper bound");
}

void print_theorem(const DisturbanceSource& source, const TrackingReport& report) {
  const Theorem& theorem = report.theorem;
  fmt::print("Theorem (limsup |e| <= d_m / (lmin(Lambda)^2 lmin(K)), continuous loop): {}\n",
             theorem.applies ? "applies" : "does not apply");
  for (const std::string& why : theorem.why_not) fmt::print("  - {}\n", why);
  if (theorem.composite) {
    fmt::print("  lmin(Lambda) {:.6g} 1/s, lmin(K) {:.6g} kg/s: {:.10g} m per N/s{}\n", theorem.min_Lambda,
               theorem.min_K, theorem.ball_per_rate(), theorem.applies ? "" : ", were its hypotheses true");
  }
  if (report.ball_m) {
    fmt::print("  ball of the continuous loop, in the long run: {:.6g} m; of the loop that flies: {}\n",
               *report.ball_m,
               report.flown_ball_m ? fmt::format("{:.6g} m", *report.flown_ball_m) : "unknown");
    if (const auto unmet = condition(report)) fmt::print("  both only if {}\n", *unmet);
  }
  if (report.vector) {
    fmt::print(
        "  exact vector gain of the continuous loop: {:.10g} .. {:.10g} m per N/s, worst along ({:.3f}, "
        "{:.3f}, "
        "{:.3f})\n",
        report.vector->lower, report.vector->upper, report.vector->direction[0], report.vector->direction[1],
        report.vector->direction[2]);
    if (const auto error_m = vector_error_m(source, report)) {
      fmt::print("  no error of it is larger than {:.6g} m in the long run, all axes together\n", *error_m);
    }
  }
}

void print_exact(const TrackingReport& report) {
  if (const std::vector<std::string> coupled = coupled_axes(report); !coupled.empty()) {
    fmt::print(
        "\nLambda or K couples the axes {}: they have no rows of their own. Ball, transient and vector gain "
        "hold "
        "for all together.\n",
        fmt::join(coupled, ", "));
  }
  if (report.exact.empty()) return;
  fmt::print("\nWorst tracking error per unit of force error (exact)\n");
  fmt::print("  {:<4} {:<8} {:<11} {:>13} {:>13} {:>13} {:>13}\n", "axis", "channel", "loop", "rate",
             "amplitude", "edge", "impulse");
  fmt::print("  {:<4} {:<8} {:<11} {:>13} {:>13} {:>13} {:>13}\n", "", "", "", "m per N/s", "m/N", "m/N",
             "m per N s");
  for (const ExactGains& row : report.exact) {
    fmt::print("  {:<4} {:<8} {:<11} {:>13} {:>13} {:>13} {:>13}\n", axis_name(row.axis), name(row.channel),
               name(row.loop), cell(row.norms.rate), cell(row.norms.amplitude), cell(row.norms.edge),
               cell(row.norms.impulse));
  }
  fmt::print("The same per m/s of error of the estimated velocity and per m of the estimated position\n");
  for (const EstimateGains& row : report.of_estimates) {
    fmt::print("  {:<4} {:<8} {:<11} {:>13} {:>13} {:>13} {:>13}\n", axis_name(row.axis), name(row.estimate),
               name(row.loop), cell(row.norms.rate), cell(row.norms.amplitude), cell(row.norms.edge),
               cell(row.norms.impulse));
  }
  const auto is_sampled = [](const ExactGains& row) { return row.loop == Loop::kSampled; };
  if (std::any_of(report.exact.begin(), report.exact.end(), is_sampled)) {
    fmt::print(
        "Rows of the sampled loop are the error at its samples; the bounds below hold between them, too "
        "(between_samples in --json)\n");
  }
}

void print_facts(const TrackingReport& report) {
  if (report.facts.empty()) return;
  fmt::print("\n  {:<4} {:>7} {:>11} {:>11} {:>13} {:>11} {:>12} {:>12}\n", "axis", "stable", "lag limit",
             "delay limit", "lag floor", "effort", "Ki acts as", "I cancels");
  fmt::print("  {:<4} {:>7} {:>11} {:>11} {:>13} {:>11} {:>12} {:>12}\n", "", "", "s", "s", "m per N/s",
             "N/N", "1/s^3", "N");
  for (const AxisFacts& f : report.facts) {
    fmt::print("  {:<4} {:>7} {:>11} {:>11} {:>13} {:>11} {:>12} {:>12}\n", axis_name(f.axis),
               f.stable ? "yes" : "NO", cell(f.lag_limit_s), cell(f.delay_limit_s), cell(f.lag_floor.rate),
               cell(f.effort_gain), cell(f.effective_Ki),
               std::isfinite(f.clamp_authority_N) ? cell(f.clamp_authority_N) : "any");
    if (std::abs(f.effective_Ki - f.written_Ki) > 1e-9 * f.written_Ki) {
      fmt::print("       the integrator's step reduces Ki by a factor of {:.4g}: {} is written\n",
                 f.written_Ki / f.effective_Ki, f.written_Ki);
    }
    if (f.clamp_residual_m > 0) {
      fmt::print("       the bias that the clamp leaves costs {:.6g} m\n", f.clamp_residual_m);
    }
  }
}

/// Prints what every bound of a row contains in addition to its class, and what the total adds.
void print_parts(const AxisBounds& row) {
  std::vector<std::string> parts;
  const auto add = [&parts](const char* what, double error_m) {
    if (error_m > 0) parts.push_back(fmt::format("{} {}", what, cell(error_m)));
  };
  add("bias", row.parts.bias_m);
  add("initial error", row.parts.initial_m);
  add("velocity error", row.parts.velocity_error_m);
  add("position error", row.parts.position_error_m);
  add("moving set point", row.parts.reference_m);
  add("thrust ratio", row.parts.thrust_ratio_m);
  if (!parts.empty()) fmt::print("       each contains: {}\n", fmt::join(parts, ", "));
  if (row.staircase_m > 0)
    fmt::print("       the total contains {} for the staircase of f_hat\n", cell(row.staircase_m));
}

void print_bounds(const DisturbanceSource& source, const TrackingReport& report) {
  if (source.kind == "none") {
    fmt::print(
        "\nNo disturbance is declared: --rate, --amplitude, --edge, --impulse or --from compare.json give "
        "bounds in metres.\n");
    return;
  }
  if (report.bounds.empty()) return;
  fmt::print("\nBounds on the tracking error from rest, all that is declared included, m ({})\n",
             source.kind);
  fmt::print("  {:<4} {:<8} {:<11} {:>10} {:>10} {:>10} {:>10} {:>10} {:>10}  {}\n", "axis", "channel",
             "loop", "rate", "amplitude", "edge", "impulse", "amp+rate", "total", "by");
  for (const AxisBounds& row : report.bounds) {
    const DisturbanceBounds& b = row.bounds;
    fmt::print("  {:<4} {:<8} {:<11} {:>10} {:>10} {:>10} {:>10} {:>10} {:>10}  {}\n", axis_name(row.axis),
               name(row.channel), name(row.loop), cell(b.by_rate), cell(b.by_amplitude), cell(b.by_edges),
               cell(b.by_impulse), cell(b.by_both), cell(row.total_m()), smallest(row));
    print_parts(row);
    if (!row.clamp.never_acts) {
      fmt::print(
          "       the integrator's clamp may act (demand {} m s): the first five hold for the linear loop "
          "only\n",
          cell(row.clamp.demand_m_s));
    }
  }
}

}  // namespace

void describe_norms(files::Record& record, const GainNorms& norms) {
  record.field("rate", norms.rate, "Error per bound on the rate of the force.", "m per N/s", "exact");
  record.field("amplitude", norms.amplitude, "Error per bound on the force.", "m/N", "exact");
  record.field("edge", norms.edge, "Error per total variation of the force.", "m/N", "exact");
  record.field("impulse", norms.impulse, "Error per impulse of the force.", "m per N s", "exact");
}

std::string cell(double value) { return std::isfinite(value) ? fmt::format("{:.6g}", value) : "-"; }

void describe(files::Record& record, const ErrorAtTime& point) {
  record.field("t_s", point.t_s, "", "s");
  record.field("error_m", point.error_m, "", "m", "upper bound");
}

void describe(files::Record& record, const TrackingResult& result) {
  const TrackingReport& report = result.report;
  record.field("mass_kg", result.mass_kg, "Of the vehicle.", "kg");
  record.field("thrust_scale", result.thrust_scale, "Actual over modelled thrust.");
  record.object("disturbance", "What was declared, and from where it comes.",
                [&result](files::Record& r) { describe_disturbance_source(r, result.source); });
  record.object("theorem", "The paper's: limsup |e| <= d_m / (lambda_min(Lambda)^2 lambda_min(K)).",
                [&report](files::Record& r) { describe_theorem(r, report); });
  record.list("exact", gain_rows(report), "Gains of every loop: the worst error per unit of a disturbance.",
              describe_gain_row);
  record.field("coupled_axes", coupled_axes(report),
               "Axes that Lambda or K couples to others: they have no loop of their own, and no rows.");
  const VectorGain vector = report.vector.value_or(VectorGain());
  record.object_or_null(
      report.vector.has_value(), "vector", "Gain of all axes together, from rate to error.",
      [&](files::Record& r) {
        r.field("peak_gain", Interval{vector.lower, vector.upper}, "", "m per N/s", "enclosure");
        r.field("direction", vector.direction, "Of the worst force error.");
        r.field("exact", vector.is_exact(), "Whether both ends agree.");
        r.field("worst_error_m", vector_error_m(result.source, report), "In the long run; null: not known.",
                "m", "upper bound");
      });
  record.list("bounds", report.bounds, "Of the error, per axis, channel and loop; null: not bounded.",
              [&result](files::Record& r, const AxisBounds& row) { describe_axis_bounds(r, row, result); });
  record.list("axes", report.facts, "Limits of every loop.", describe_facts);
  record.field("thrust_margin_N", report.saturation.margin_N(),
               "Distance of the commanded forces from the nearer limit; null: not known.", "N",
               "lower bound");
  record.object("thrust", "What all declared inputs together can make the law command.",
                [&report](files::Record& r) { describe_thrust(r, report.saturation); });
  record.field("assumptions", report.assumptions, "What the numbers rest on.");
}

void print_tracking(const Tracking& input, const DisturbanceSource& source, const TrackingReport& report) {
  for (const std::string& note : input.notes) fmt::print("  with {}\n", note);
  fmt::print("\n");
  print_theorem(source, report);
  print_exact(report);
  print_facts(report);
  if (source.f_hat_rate_known) {
    fmt::print("\nrate of f_hat: at most {:.6g} N/s (bounds the learned force, not its error)\n",
               source.f_hat_rate_N_s);
  }
  print_bounds(source, report);
  if (const auto unmet = condition(report); unmet && source.kind != "none")
    fmt::print("\nThese totals hold only if {}\n", *unmet);
  fmt::print("\nRests on\n");
  for (const Assumption& a : report.assumptions) {
    fmt::print("  {:<9} {}{}\n", a.status, a.name, a.note.empty() ? "" : " (" + a.note + ")");
  }
}

}  // namespace swarmcert::analysis

namespace swarmcert::stability {

void describe(files::Record& record, const Assumption& assumption) {
  record.field("name", assumption.name, "");
  record.field("status", assumption.status,
               "proved, measured, assumed or refuted, with the counterexample as note.");
  record.field("note", assumption.note, "");
}

}  // namespace swarmcert::stability
