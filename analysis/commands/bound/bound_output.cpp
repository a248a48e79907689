#include "analysis/commands/bound/bound_output.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

namespace swarmcert::analysis {
namespace {

using files::Json;
using namespace stability;  // NOLINT: every name below is of that library

Json theorem_json(const TrackingReport& report) {
  const Theorem& theorem = report.theorem;
  Json json = {{"applies", theorem.applies},
               {"why_not", theorem.why_not},
               {"ball", report.ball_m ? Json(*report.ball_m) : Json()},
               {"ball_of_flown_loop", report.flown_ball_m ? Json(*report.flown_ball_m) : Json()},
               {"ball_unit", "m"},
               {"ball_per_rate", nullptr},
               {"lambda_min_Lambda", nullptr},
               {"lambda_min_K", nullptr},
               {"transient", nullptr}};
  if (!theorem.composite) return json;
  json["ball_per_rate"] = theorem.ball_per_rate();
  json["lambda_min_Lambda"] = theorem.min_Lambda;
  json["lambda_min_K"] = theorem.min_K;
  if (!report.transient) return json;
  Json at = Json::array();
  for (const double t_s : {0.0, 0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0}) {
    at.push_back({{"t_s", t_s}, {"error_m", report.transient->at(t_s)}});
  }
  json["transient"] = {{"decay_1_s", report.transient->decay_1_s()},
                       {"s_dot_m_s2", report.transient->s_dot_m_s2},
                       {"rate_N_s", report.transient->rate_N_s},
                       {"valid", theorem.applies},
                       {"bound", std::move(at)}};
  return json;
}

/// What every total is subject to; null if it is proved.
Json condition(const TrackingReport& report) {
  const Saturation& thrust = report.saturation;
  if (thrust.is_proved()) return nullptr;
  return std::string("the thrust does not saturate, which is ") + name(thrust.verdict) + ": " + thrust.why;
}

/// Name of the bound that row.least() returns.
std::string smallest(const AxisBounds& row) {
  if (row.least() == row.bounds.least() && row.clamp.never_acts) return row.bounds.which();
  if (!std::isfinite(row.least())) return "none";
  return row.clamp.by_amplitude < row.clamp.by_impulse ? "amplitude with clamp" : "impulse with clamp";
}

Json bounds_json(const AxisBounds& row, const TrackingReport& report) {
  const DisturbanceBounds& b = row.bounds;
  return {{"axis", axis_name(row.axis)},
          {"channel", name(row.channel)},
          {"loop", name(row.loop)},
          {"unit", "m"},
          {"rate", finite(b.by_rate)},
          {"amplitude", finite(b.by_amplitude)},
          {"edge", finite(b.by_edges)},
          {"impulse", finite(b.by_impulse)},
          {"amplitude_and_rate", finite(b.by_both)},
          {"integrator_demand_m_s", finite(row.clamp.demand_m_s)},
          {"clamp_never_acts", row.clamp.never_acts},
          {"amplitude_with_clamp", finite(row.clamp.by_amplitude)},
          {"impulse_with_clamp", finite(row.clamp.by_impulse)},
          {"minimum", finite(row.least())},
          {"guarantee", "bound"},
          {"condition", condition(report)},
          {"smallest", smallest(row)},
          {"parts",
           {{"bias", finite(row.parts.bias_m)},
            {"initial", finite(row.parts.initial_m)},
            {"velocity_error", finite(row.parts.velocity_error_m)},
            {"position_error", finite(row.parts.position_error_m)},
            {"reference", finite(row.parts.reference_m)},
            {"thrust_ratio", finite(row.parts.thrust_ratio_m)}}},
          {"staircase", finite(row.staircase_m)},
          {"float32", finite(row.float32_m)},
          {"total", finite(row.total_m())}};
}

Json facts_json(const AxisFacts& f) {
  return {{"axis", axis_name(f.axis)},
          {"stable", f.stable},
          {"spectral_radius", f.spectral_radius > 0 ? Json(f.spectral_radius) : Json()},
          {"lag_limit_s", finite(f.lag_limit_s)},
          {"delay_limit_s", finite(f.delay_limit_s)},
          {"lag_floor_rate", finite(f.lag_floor.rate)},
          {"lag_floor_impulse", finite(f.lag_floor.impulse)},
          {"effort_gain", finite(f.effort_gain)},
          {"written_Ki", f.written_Ki},
          {"effective_Ki", f.effective_Ki},
          {"integral_authority_N", finite(f.clamp_authority_N)},
          {"clamp_residual_m", f.clamp_residual_m},
          {"noise_error_m", finite(f.noise.error_m)},
          {"noise_command_m_s2", finite(f.noise.command_m_s2)}};
}

Json amplitudes_json(const EstimateError (&errors)[3]) {
  return {finite(errors[0].amplitude), finite(errors[1].amplitude), finite(errors[2].amplitude)};
}

/// All stated errors of both estimates, one row per axis with an error.
Json estimate_errors_json(const DisturbanceSource& source) {
  Json rows = Json::array();
  for (int axis = 0; axis < 3; ++axis) {
    for (const auto& [estimate, unit] :
         {std::pair(Estimate::kVelocity, "m/s"), std::pair(Estimate::kPosition, "m")}) {
      const EstimateError& n =
          estimate == Estimate::kVelocity ? source.velocity_error[axis] : source.position_error[axis];
      if (n.is_zero()) continue;
      rows.push_back({{"axis", axis_name(axis)},
                      {"channel", name(estimate)},
                      {"unit", unit},
                      {"amplitude", finite(n.amplitude)},
                      {"rate_per_s", finite(n.rate)},
                      {"variation", finite(n.variation)},
                      {"impulse_s", finite(n.impulse)},
                      {"constant", n.constant},
                      {"window_s", n.window_s > 0 ? Json(n.window_s) : Json()}});
    }
  }
  return rows;
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
    if (const Json unmet = condition(report); !unmet.is_null())
      fmt::print("  both only if {}\n", unmet.get<std::string>());
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

namespace {

Json norms_json(const GainNorms& norms) {
  files::Node node;
  files::Record record(node, false);
  describe_norms(record, norms);
  return files::to_json(node);
}

}  // namespace

std::string cell(double value) { return std::isfinite(value) ? fmt::format("{:.6g}", value) : "-"; }

void add_tracking_json(Json& result, const Tracking& input, const DisturbanceSource& source,
                       const TrackingReport& report) {
  result["mass_kg"] = input.plant.mass_kg;
  result["thrust_scale"] = input.plant.thrust_scale;
  result["disturbance"] = {{"source", source.kind},
                           {"f_hat_rate_N_s", source.f_hat_rate_known ? Json(source.f_hat_rate_N_s) : Json()},
                           {"bias_N", source.bias_N},
                           {"velocity_error_m_s", amplitudes_json(source.velocity_error)},
                           {"thrust_ratio_error", source.thrust_ratio_error},
                           {"position_error_m", amplitudes_json(source.position_error)},
                           {"of_estimates", estimate_errors_json(source)}};
  result["theorem"] = theorem_json(report);
  result["exact"] = Json::array();
  for (const ExactGains& row : report.exact) {
    Json json = {{"axis", axis_name(row.axis)}, {"channel", name(row.channel)}, {"loop", name(row.loop)}};
    json.update(norms_json(row.norms));
    if (row.loop == Loop::kSampled) json["between_samples"] = norms_json(row.all_times);
    result["exact"].push_back(std::move(json));
  }
  for (const EstimateGains& row : report.of_estimates) {
    Json json = {{"axis", axis_name(row.axis)}, {"channel", name(row.estimate)}, {"loop", name(row.loop)}};
    json.update(norms_json(row.norms));
    if (row.loop == Loop::kSampled) json["between_samples"] = norms_json(row.all_times);
    result["exact"].push_back(std::move(json));
  }
  result["coupled_axes"] = coupled_axes(report);
  result["vector"] = nullptr;
  if (report.vector) {
    result["vector"] = {{"peak_gain", {report.vector->lower, report.vector->upper}},
                        {"direction", report.vector->direction},
                        {"exact", report.vector->is_exact()}};
    const auto error_m = vector_error_m(source, report);
    result["vector"]["worst_error_m"] = error_m ? Json(*error_m) : Json();
  }
  result["bounds"] = Json::array();
  for (const AxisBounds& row : report.bounds) {
    result["bounds"].push_back(bounds_json(row, report));
    if (source.kind == "rate of f_hat") result["bounds"].back()["of"] = "rate of f_hat";
  }
  result["axes"] = Json::array();
  for (const AxisFacts& f : report.facts) result["axes"].push_back(facts_json(f));
  const Saturation& thrust = report.saturation;
  result["thrust_margin_N"] = finite(thrust.margin_N());
  result["thrust"] = {
      {"verdict", name(thrust.verdict)},
      {"why", thrust.why},
      {"feedback_N",
       {finite(thrust.feedback_N[0]), finite(thrust.feedback_N[1]), finite(thrust.feedback_N[2])}},
      {"least_N", finite(thrust.least_N)},
      {"most_N", finite(thrust.most_N)},
      {"available_N", {thrust.available_N.lower, finite(thrust.available_N.upper)}},
      {"tilt_rad", thrust.tilt_rad()}};
  result["assumptions"] = Json::array();
  for (const Assumption& a : report.assumptions) {
    result["assumptions"].push_back({{"name", a.name}, {"status", a.status}, {"note", a.note}});
  }
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
  if (const Json unmet = condition(report); source.kind != "none" && !unmet.is_null())
    fmt::print("\nThese totals hold only if {}\n", unmet.get<std::string>());
  fmt::print("\nRests on\n");
  for (const Assumption& a : report.assumptions) {
    fmt::print("  {:<9} {}{}\n", a.status, a.name, a.note.empty() ? "" : " (" + a.note + ")");
  }
}

}  // namespace swarmcert::analysis
