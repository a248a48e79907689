#include "analysis/commands/bound/truth_input.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "analysis/commands/bound/disturbance_input.h"
#include "nn/base/input_error.h"

namespace swarmcert::analysis {
namespace {

using stability::DisturbanceSource;

/// Parses "0.15:0.8".
void read_gap(const std::string& text, stability::MotionSet& motion) {
  char* end = nullptr;
  motion.least_gap_m = std::strtod(text.c_str(), &end);
  const bool has_colon = end != text.c_str() && *end == ':';
  const char* const second = has_colon ? end + 1 : end;
  motion.largest_gap_m = std::strtod(second, &end);
  if (!has_colon || end == second || *end != '\0' || !(motion.least_gap_m >= 0) ||
      !(motion.least_gap_m < motion.largest_gap_m)) {
    throw UsageError("--gap " + files::in_quotes(text) + ": write FROM:TO in m, e.g. 0.15:0.8");
  }
}

}  // namespace

Truth read_truth(const DisturbanceArguments& arguments, const Tracking& tracking) {
  Truth truth;
  truth.path = arguments.truth;
  const stability::Model model = stability::read_model(arguments.truth);
  stability::MotionSet& motion = truth.motion;
  const auto known = [](double given) { return given < 0 ? std::numeric_limits<double>::infinity() : given; };
  motion.relative_speed_m_s = known(arguments.speed);
  motion.speed_m_s = known(arguments.own_speed);
  motion.acceleration_m_s2 = known(arguments.own_accel);
  motion.thrust_rate_N_s = known(arguments.thrust_rate);
  motion.neighbours = arguments.neighbours;
  motion.neighbour_mass_kg = arguments.neighbour_mass > 0 ? arguments.neighbour_mass : model.mass_kg;
  motion.least_height_m = arguments.least_height;
  motion.largest_height_m = known(arguments.largest_height);
  motion.largest_thrust_N = tracking.plant.largest_thrust_N * tracking.plant.thrust_scale;
  if (!arguments.gap.empty()) read_gap(arguments.gap, motion);
  truth.effects = truth_bounds(model, motion);
  return truth;
}

void add_truth(const Truth& truth, DisturbanceSource& source) {
  const bool has_network = source.kind == "rate of f_hat";
  double square = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    stability::Disturbance& d = source.axis[i];
    d.amplitude_N = has_network && i == 2 ? std::numeric_limits<double>::infinity() : 0;
    d.rate_N_s = has_network && i == 2 ? source.f_hat_rate_N_s : 0;
    for (const stability::EffectBounds& effect : truth.effects) {
      d.amplitude_N += effect.amplitude_N[i];
      d.rate_N_s += effect.rate_N_s[i];
      source.bias_N[i] += effect.bias_N[i];
    }
    d.amplitude_N *= 1 + 1e-14;  // for the rounding of the sums
    d.rate_N_s *= 1 + 1e-14;
    square += d.rate_N_s * d.rate_N_s;
  }
  source.rate_norm_N_s = std::sqrt(square) * (1 + 1e-15);
  source.kind = "declared truth";
  source.note = has_network ? "f_hat minus the declared truth" : "the declared truth, without f_hat";
}

namespace {

std::string domain_text(const stability::MotionSet& m) {
  std::string text = fmt::format("{} neighbour{}", m.neighbours, m.neighbours == 1 ? "" : "s");
  if (m.least_gap_m > 0 || std::isfinite(m.largest_gap_m)) {
    text += fmt::format(", height gaps {} .. {} m", m.least_gap_m, m.largest_gap_m);
  }
  const auto add = [&text](const char* what, double value, const char* unit) {
    if (std::isfinite(value)) text += fmt::format(", {} at most {} {}", what, value, unit);
  };
  add("relative speed", m.relative_speed_m_s, "m/s");
  add("speed", m.speed_m_s, "m/s");
  add("acceleration", m.acceleration_m_s2, "m/s^2");
  add("rate of thrust", m.thrust_rate_N_s, "N/s");
  if (m.least_height_m > 0) text += fmt::format(", height from {} m", m.least_height_m);
  add("height", m.largest_height_m, "m");
  return text;
}

std::array<double, 3> per_axis(const double (&values)[3]) { return {values[0], values[1], values[2]}; }

}  // namespace

void describe(files::Record& record, const Truth& truth) {
  record.field("file", truth.path, "The model.");
  record.field("over", domain_text(truth.motion), "Motions over which the force is enclosed.");
  record.list(
      "effects", truth.effects, "Null: not bounded.", [](files::Record& r, const stability::EffectBounds& e) {
        r.field("effect", e.effect, "");
        r.field("bias_N", per_axis(e.bias_N), "Constant part.", "N", "upper bound");
        r.field("amplitude_N", per_axis(e.amplitude_N), "Of the rest.", "N", "upper bound");
        r.field("rate_N_s", per_axis(e.rate_N_s), "", "N/s", "upper bound");
        r.field("slope_across_N_m", e.slope_across_N_m, "Of one neighbour's force.", "N/m", "upper bound");
        r.field("slope_along_N_m", e.slope_along_N_m, "Likewise along z.", "N/m", "upper bound");
        r.field("reached_rate_N_s", e.reached_rate_N_s, "At some motion; 0: unknown.", "N/s", "lower bound");
        r.field("unbounded", e.unbounded, "Why it is not bounded.");
        r.field("note", e.note, "");
      });
}

void print(const Truth& truth) {
  fmt::print("\nDeclared truth {}, enclosed over {}\n", truth.path, domain_text(truth.motion));
  for (const stability::EffectBounds& e : truth.effects) {
    const auto largest = [](const double* v) { return std::max({v[0], v[1], v[2]}); };
    fmt::print("  {:<16} |f| <= {:.6g} N, |f'| <= {:.6g} N/s", e.effect,
               largest(e.amplitude_N) + largest(e.bias_N), largest(e.rate_N_s));
    if (e.slope_along_N_m > 0) {
      fmt::print(", slope {:.6g} N/m along z, {:.6g} N/m across", e.slope_along_N_m, e.slope_across_N_m);
    }
    if (!e.note.empty()) fmt::print(" ({})", e.note);
    if (!e.unbounded.empty()) fmt::print(": {}", e.unbounded);
    fmt::print("\n");
  }
}

}  // namespace swarmcert::analysis
