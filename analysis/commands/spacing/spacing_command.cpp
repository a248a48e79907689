#include <fmt/core.h>

#include <cmath>
#include <memory>

#include "analysis/cli/command_line.h"
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
  std::string disturbance;
  std::string report;
};

/// The field of `neighbour` as stated by `model`, or the published fit of the effect if the model has no downwash.
DownwashField field_of(const stability::Model& model, double neighbour_mass_kg, std::string& source) {
  stability::EffectSpec spec;
  spec.name = "downwash";
  source = "published fit, " + model.path + " has no downwash";
  for (const stability::EffectSpec& effect : model.effects) {
    if (effect.name == "downwash") {
      spec = effect;
      source = model.path;
    }
  }
  const auto value = [&spec](const char* name) { return effect_value(spec, name); };
  DownwashField field;
  field.amplitude_N =
      std::abs(value("amplitude_N")) * std::pow(neighbour_mass_kg / 0.034, value("mass_exponent"));
  field.decay = value("decay_exponent");
  field.spread_m = value("spread_m");
  field.spread_slope = value("spread_slope");
  field.tail = value("tail");
  return field;
}

struct SpacingResult {
  stability::SpacingQuestion question;
  std::string field_from;
  std::string beside;  ///< disturbance.toml; empty: nothing else disturbs the lower vehicle
  stability::Spacing found;
};

void describe_row(files::Record& record, const stability::SpacingRow& row) {
  record.field("height_gap_m", row.height_gap_m, "Height of the upper vehicles above the lower one.", "m");
  record.field("peak_force_N", row.peak_force_N, "Largest force of the field at this gap, with the guard.",
               "N");
  record.field("stay_error_m", row.stay_error_m, "Error of a vehicle that stays below, or enters slowly.",
               "m", "upper bound for the field");
  record.field("may_stay", row.may_stay, "Whether that error is within the limit, with thrust to spare.");
  record.field("keep_out_radius_m", row.keep_out_radius_m,
               "Distance to the side from which any motion is safe.", "m");
  record.field("may_cross", std::isfinite(row.least_speed_m_s),
               "Whether a straight pass may be fast enough.");
  record.field("least_speed_m_s", row.least_speed_m_s, "Least speed of a straight pass; null: none suffices.",
               "m/s");
  record.field("thrust_margin_N", row.thrust_margin_N, "Thrust that is left; negative: saturates.", "N");
}

void describe(files::Record& record, const SpacingResult& result) {
  record.field("max_error_m", result.question.max_error_m, "Largest vertical error that is allowed.", "m");
  record.field("dwell_s", result.question.dwell_s,
               "Least time outside the keep-out radius between two passes.", "s");
  record.field("neighbours", result.question.neighbours, "Vehicles above at the same time.");
  record.field("guard", result.question.guard, "Factor on predicted forces.");
  record.field("field", result.field_from, "Where the field of force comes from.");
  record.field("beside", result.beside,
               "What else disturbs the lower vehicle, contained in every number; empty: nothing.");
  record.field("least_gap_to_stay_m", result.found.least_gap_to_stay_m,
               "Least gap at which a vehicle may stay below; null: none in range.", "m");
  record.field("least_gap_to_cross_m", result.found.least_gap_to_cross_m,
               "Least gap at which a vehicle may cross below; null: none in range.", "m");
  record.list("shape", result.found.shape, "What is allowed at every height gap.", describe_row);
}

Table rows_of(const files::Node& result) {
  return table(*result.find("shape"), {{"height_gap_m", "height gap", "{:.3f}"},
                                       {"peak_force_N", "force"},
                                       {"stay_error_m", "error if it stays"},
                                       {"may_stay"},
                                       {"keep_out_radius_m", "keep-out radius", "{:.3f}"},
                                       {"may_cross"},
                                       {"least_speed_m_s", "cross at least at", "{:.2f}"},
                                       {"thrust_margin_N", "thrust left"}});
}

std::string gap_text(double gap_m) {
  return std::isfinite(gap_m) ? fmt::format("{:.3f} m", gap_m) : "none in range";
}

void print_spacing(const SpacingResult& result, const files::Node& described) {
  const stability::SpacingQuestion& question = result.question;
  fmt::print("Error at most {} m below {} vehicle(s), no feed-forward; field: {}; guard factor {}{}\n\n{}",
             question.max_error_m, question.neighbours, result.field_from, question.guard,
             result.beside.empty() ? "" : "; beside " + result.beside, to_text(rows_of(described)));
  fmt::print(
      "\nEach line holds for any number of straight passes at this speed or faster, with {:g} s or more "
      "outside the "
      "radius between two of them, and any motion outside.\n",
      question.dwell_s);
  fmt::print("\nleast gap to stay below: {}; to cross below: {}\n",
             gap_text(result.found.least_gap_to_stay_m), gap_text(result.found.least_gap_to_cross_m));
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
  SpacingResult result;
  result.question = options.question;
  const DownwashField field = field_of(input.model, neighbour_mass_kg, result.field_from);
  const stability::DisturbanceSource beside = load_disturbance_file(options.disturbance);
  if (!options.disturbance.empty()) inputs.push_back(options.disturbance);
  if (beside.thrust_ratio_error > 0)
    throw UsageError(options.disturbance + ": spacing contains no thrust_ratio_error; leave it out");
  result.beside = options.disturbance;
  result.found = spacing(input, field, beside, options.question);

  const files::Node described = result_of("spacing", inputs, std::nullopt, result);
  write_result(common, described);
  std::string report;
  if (!options.report.empty())
    report = write_spacing_report(result.question, result.found, rows_of(described), described,
                                  options.report, common.force);
  if (common.prints_text()) {
    print_spacing(result, described);
    if (!report.empty()) fmt::print("report: {}\n", report);
    print_next(common, {"simulate", "swap", "--vehicles", "2", "--gains", options.tracking.gains, "--model",
                        options.tracking.model, "-o", "flights"});
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
            app.add_option("--disturbance", options->disturbance,
                           "disturbance.toml: what disturbs the lower vehicle beside the field");
            add_output(app, "--report", options->report, "Write an HTML report with plots into this folder");
            return [options](const CommonOptions& common) { return run_spacing(*options, common); };
          },
          fields_of<SpacingResult>()};
}

}  // namespace swarmcert::analysis
