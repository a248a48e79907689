#include <fmt/core.h>

#include <cmath>
#include <memory>

#include "analysis/cli/command_line.h"
#include "analysis/commands/bound/bound_output.h"
#include "analysis/commands/commands.h"
#include "analysis/commands/shared/tracking_input.h"
#include "analysis/commands/spacing/spacing_report.h"
#include "nn/base/input_error.h"
#include "stability/bounds/swarms/spacing.h"
#include "stability/effects/registry.h"

namespace swarmcert::analysis {
namespace {

using stability::DownwashField;

struct SpacingOptions {
  TrackingArguments tracking;
  std::string neighbour_model;
  stability::SpacingQuestion question;
  std::string report;
};

/// The field of `neighbour` as stated by `model`, or the published fit of the effect if the model has no downwash.
DownwashField field_of(const stability::Model& model, double neighbour_mass_kg, std::string& source) {
  const stability::EffectInfo& info = stability::effect_info("downwash");
  stability::EffectSpec spec;
  spec.name = "downwash";
  source = "published fit, " + model.path + " has no downwash";
  for (const stability::EffectSpec& effect : model.effects) {
    if (effect.name == "downwash") {
      spec = effect;
      source = model.path;
    }
  }
  const stability::EffectValues values = effect_values(info, spec);
  const auto shape = [&](const char* name) {
    for (std::size_t i = 0; i < info.shape.size(); ++i) {
      if (info.shape[i].name == name) return values.shape.at(i);
    }
    throw std::logic_error(std::string("downwash has no parameter ") + name);
  };
  DownwashField field;
  field.amplitude_N =
      std::abs(values.linear.at(0)) * std::pow(neighbour_mass_kg / 0.034, shape("mass_exponent"));
  field.decay = shape("decay_exponent");
  field.spread_m = shape("spread_m");
  field.spread_slope = shape("spread_slope");
  field.tail = shape("tail");
  return field;
}

/// @param source the source of the field.
void add_spacing(const stability::SpacingQuestion& question, const stability::Spacing& found,
                 const std::string& source, files::Json& result) {
  result["max_error_m"] = question.max_error_m;
  result["dwell_s"] = question.dwell_s;
  result["neighbours"] = question.neighbours;
  result["guard"] = question.guard;
  result["field"] = source;
  result["least_gap_to_stay_m"] = finite(found.least_gap_to_stay_m);
  result["least_gap_to_cross_m"] = finite(found.least_gap_to_cross_m);
  result["shape"] = files::Json::array();
  for (const stability::SpacingRow& row : found.shape) {
    result["shape"].push_back({{"height_gap_m", row.height_gap_m},
                               {"peak_force_N", row.peak_force_N},
                               {"stay_error_m", finite(row.stay_error_m)},
                               {"may_stay", row.may_stay},
                               {"keep_out_radius_m", finite(row.keep_out_radius_m)},
                               {"may_cross", std::isfinite(row.least_speed_m_s)},
                               {"least_speed_m_s", finite(row.least_speed_m_s)},
                               {"thrust_margin_N", finite(row.thrust_margin_N)}});
  }
}

void print_spacing(const stability::SpacingQuestion& question, const stability::Spacing& found,
                   const std::string& source) {
  fmt::print("Error at most {} m below {} vehicle(s), no feed-forward; field: {}; guard factor {}\n\n",
             question.max_error_m, question.neighbours, source, question.guard);
  fmt::print("  {:>8} {:>9} {:>11} {:>10} {:>14} {:>12}\n", "gap", "force", "error if", "keep out",
             "cross at", "thrust left");
  fmt::print("  {:>8} {:>9} {:>11} {:>10} {:>14} {:>12}\n", "m", "N", "it stays, m", "radius, m",
             "least, m/s", "N");
  for (const stability::SpacingRow& row : found.shape) {
    fmt::print("  {:>8.3f} {:>9.4f} {:>11.4f} {:>10.3f} {:>14} {:>12.4f}\n", row.height_gap_m,
               row.peak_force_N, row.stay_error_m, row.keep_out_radius_m,
               row.may_stay                         ? "may stay"
               : std::isfinite(row.least_speed_m_s) ? fmt::format("{:.2f}", row.least_speed_m_s)
                                                    : "never",
               row.thrust_margin_N);
  }
  fmt::print(
      "\nEach line holds for any number of straight passes at this speed or faster, with {:g} s or more "
      "outside the "
      "radius between two of them, and any motion outside.\n",
      question.dwell_s);
  fmt::print("\nleast gap to stay below: {}; to cross below: {}\n",
             std::isfinite(found.least_gap_to_stay_m) ? fmt::format("{:.3f} m", found.least_gap_to_stay_m)
                                                      : "none in range",
             std::isfinite(found.least_gap_to_cross_m) ? fmt::format("{:.3f} m", found.least_gap_to_cross_m)
                                                       : "none in range");
  if (question.guard == 1) {
    fmt::print(
        "Peaks in ten recorded swaps were 1.0 to 2.6 times what such a model predicts: --guard covers "
        "that.\n");
  }
}

int run_spacing(const SpacingOptions& options, const CommonOptions& common) {
  if (options.question.steps > 1 && !(options.question.from_m < options.question.to_m)) {
    throw UsageError(fmt::format("--from {:g} --to {:g}: --from is the smaller height gap",
                                 options.question.from_m, options.question.to_m));
  }
  refuse_to_replace(common, common.json);
  refuse_folder(common, options.report);
  const Tracking input = load_tracking(options.tracking);
  std::vector<std::string> inputs = {options.tracking.gains, options.tracking.model};
  double neighbour_mass_kg = input.model.mass_kg;
  if (!options.neighbour_model.empty()) {
    neighbour_mass_kg = stability::read_model(options.neighbour_model).mass_kg;
    inputs.push_back(options.neighbour_model);
  }
  if (!input.continuous(2))
    throw UsageError("Lambda or K couples the z axis to others: spacing needs its own loop");
  std::string source;
  const DownwashField field = field_of(input.model, neighbour_mass_kg, source);
  const stability::Spacing found = spacing(input, field, options.question);

  files::Json result = result_head("spacing", inputs);
  add_spacing(options.question, found, source, result);
  write_result(common, result);
  std::string report;
  if (!options.report.empty())
    report = write_spacing_report(options.question, found, result, options.report, common.force);
  if (common.prints_text()) {
    print_spacing(options.question, found, source);
    if (!report.empty()) fmt::print("report: {}\n", report);
  }
  return kDone;
}

}  // namespace

Command spacing_command() {
  return {"spacing", "Least distance and crossing speed for vehicles that pass below one another",
          "States for every height gap whether the lower vehicle may stay there, how far to the side it "
          "must keep\n"
          "otherwise, and how fast it must cross, however often and with how much time between, so that its\n"
          "error bound stays below the limit with thrust to spare.\n\n"
          "Example: swarmcert spacing --gains controller/gains/crazyflie-small.toml --model "
          "stability/models/crazyflie-small.toml \\\n           --max-error 0.1",
          [](CLI::App& app) {
            const auto options = std::make_shared<SpacingOptions>();
            declare_tracking(app, options->tracking);
            auto& question = options->question;
            app.add_option("--max-error", question.max_error_m, "Largest vertical error, m")
                ->required()
                ->check(CLI::PositiveNumber);
            app.add_option("--dwell", question.dwell_s,
                           "Least time outside the keep-out radius between two passes, s (default 2)")
                ->check(CLI::PositiveNumber);
            app.add_option("--neighbours", question.neighbours, "Vehicles above at the same time (default 1)")
                ->check(CLI::PositiveNumber);
            app.add_option("--neighbour-model", options->neighbour_model, "model.toml of the vehicles above");
            app.add_option("--guard", question.guard, "Factor on predicted forces (default 1)")
                ->check(CLI::Range(1.0, 100.0));
            app.add_option("--from", question.from_m, "Smallest height gap, m (default 0.15)")
                ->check(CLI::PositiveNumber);
            app.add_option("--to", question.to_m, "Largest height gap, m (default 0.8)")
                ->check(CLI::PositiveNumber);
            app.add_option("--steps", question.steps, "Number of height gaps (default 27)")
                ->check(CLI::Range(1, 10000));
            add_output(app, "--report", options->report, "Write an HTML report with plots into this folder");
            return [options](const CommonOptions& common) { return run_spacing(*options, common); };
          }};
}

}  // namespace swarmcert::analysis
