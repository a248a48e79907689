#include <fmt/core.h>

#include <array>
#include <memory>

#include "analysis/cli/command_line.h"
#include "analysis/commands/commands.h"
#include "analysis/commands/identify_thrust/identify_thrust_report.h"
#include "analysis/identification/thrust/thrust_identification.h"
#include "controller/battery.h"
#include "controller/mixing.h"

namespace swarmcert::analysis {
namespace {

struct IdentifyThrustOptions {
  std::string file, report;
  int rotors = 1;
  double confidence = 0.95;
};

struct ThrustResult {
  IdentifyThrustOptions options;
  ThrustData data;
  ThrustIdentification found;

  bool is_determined() const {
    return found.thrust.determined && found.pwm.determined && found.max_thrust.determined;
  }
};

void describe_fit(files::Record& record, const PolynomialFit& fit) {
  record.field("determined", fit.determined, "Whether the data determine every coefficient.");
  record.field("method", fit.method, "Of the fit.");
  record.field("unit", fit.unit, "Of the residuals.");
  record.field("samples", fit.samples, "Rows that were fitted.");
  record.field("residual_rms", fit.residual_rms, "In `unit`.");
  record.field("largest_residual", fit.largest_residual, "In `unit`.");
  record.field("largest_uncertainty", fit.largest_uncertainty,
               "Of the polynomial within the data, in `unit`.");
  record.object_or_null(!fit.lack.against.empty(), "lack_of_fit",
                        "What the fit cannot follow; null: not tested.", [&](files::Record& r) {
                          r.field("against", fit.lack.against, "repeated rows or terms of the next order.");
                          r.field("found", fit.lack.is_found(), "Whether the chance is below 1 %.");
                          r.field("F", fit.lack.F, "Of the F test.");
                          r.field("degrees_of_freedom", std::array<int, 2>{fit.lack.terms, fit.lack.left},
                                  "Of what is lacking and of the noise.");
                          r.field("chance", fit.lack.chance, "Of such an F where nothing is lacking.");
                          r.field("rms", fit.lack.rms, "Of what is lacking, in `unit`.");
                        });
  record.may("why_not", fit.determined ? std::nullopt : std::optional<std::string>(fit.why_not),
             "What the data lack.");
}

void describe_coefficient(files::Record& record, const Coefficient& c) {
  record.field("value", c.value, "p = PWM / 65536, v = V / 4.2; gram-force of one rotor.");
  record.field("interval", std::array<double, 2>{c.lower, c.upper}, "At the stated confidence.");
}

void describe_source(files::Record& record, const SignalSource& source) {
  record.field("column", source.column, "Of the table.");
  record.field("unit", source.unit, "Of the column.");
}

void describe(files::Record& record, const ThrustResult& result) {
  const ThrustIdentification& found = result.found;
  record.field("verdict", result.is_determined() ? "determined" : "undetermined",
               "determined: the data determine all three polynomials.");
  record.object("columns", "Which column was taken for what.", [&](files::Record& columns) {
    columns.object("pwm", "Command.", [&](files::Record& one) { describe_source(one, result.data.pwm); });
    columns.object("voltage", "Of the battery.",
                   [&](files::Record& one) { describe_source(one, result.data.voltage); });
    columns.object("thrust", "Of all rotors.",
                   [&](files::Record& one) { describe_source(one, result.data.thrust); });
  });
  record.field("rotors", result.options.rotors, "Rotors whose force the table states together.");
  record.field("samples", result.data.samples.size(), "Rows that were used.");
  record.field("confidence", result.options.confidence, "Of the intervals.");
  record.object("range", "What the fit covers.", [&](files::Record& range) {
    range.field("p", std::array<double, 2>{found.smallest_p, found.largest_p}, "Share of the full command.");
    range.field("battery_V",
                std::array<double, 2>{found.smallest_v * controller::kReferenceVoltage_V,
                                      found.largest_v * controller::kReferenceVoltage_V},
                "Of the battery.", "V");
  });
  const std::vector<std::pair<std::string, PolynomialFit>> fits = {{"thrust", found.thrust},
                                                                   {"pwm", found.pwm},
                                                                   {"max_thrust", found.max_thrust},
                                                                   {"motor_voltage", found.motor_voltage}};
  std::vector<std::pair<std::string, Coefficient>> coefficients;
  for (const auto& [name, fit] : fits)
    for (const Coefficient& c : fit.coefficients) coefficients.emplace_back(c.name, c);
  record.entries(
      "coefficients", coefficients,
      "Of the polynomials, by name; VMOTOR2THRUST0 .. 3: N of one rotor over the voltage of its motor.",
      describe_coefficient);
  record.entries("fits", fits, "How well they fit.", describe_fit);
}

void print(const ThrustData& data, const ThrustIdentification& result) {
  fmt::print("{}: {} rows, PWM {:.2f} to {:.2f} of full, battery {:.2f} to {:.2f} V\n", data.path,
             data.samples.size(), result.smallest_p, result.largest_p,
             result.smallest_v * controller::kReferenceVoltage_V,
             result.largest_v * controller::kReferenceVoltage_V);
  fmt::print("pwm: '{}' in {}; voltage: '{}' in {}; thrust: '{}' in {}\n", data.pwm.column, data.pwm.unit,
             data.voltage.column, data.voltage.unit, data.thrust.column, data.thrust.unit);
  constexpr const char* kFormulas[] = {
      "gf of one rotor = c00 + c10 p + c01 v + c20 p^2 + c11 p v",
      "p = d00 + d10 g + d01 v + d20 g^2 + d11 g v", "largest gf of one rotor = e00 + e10 p + e01 v",
      "N of one rotor = VMOTOR2THRUST0 + .. 1 u + .. 2 u^2 + .. 3 u^3, u = p V"};
  const PolynomialFit* const fits[] = {&result.thrust, &result.pwm, &result.max_thrust,
                                       &result.motor_voltage};
  for (int i = 0; i < 4; ++i) {
    const PolynomialFit& fit = *fits[i];
    fmt::print("\n{}   (p = PWM / 65536, v = V / 4.2)\n", kFormulas[i]);
    if (!fit.determined) {
      fmt::print("  not determined: {}\n", fit.why_not);
      continue;
    }
    fmt::print("  {}; residual rms {:.4g} {}, largest {:.4g}\n", fit.method, fit.residual_rms, fit.unit,
               fit.largest_residual);
    if (!fit.lack.against.empty())
      fmt::print("  {}: F({}, {}) = {:.3g} against {}, chance {:.2g}{}\n",
                 fit.lack.is_found() ? "lack of fit" : "no lack of fit", fit.lack.terms, fit.lack.left,
                 fit.lack.F, fit.lack.against, fit.lack.chance,
                 fit.lack.is_found() ? fmt::format("; rms {:.3g} {}", fit.lack.rms, fit.unit) : "");
    for (const Coefficient& c : fit.coefficients) {
      fmt::print("  {} = {:<24.17g}# {:g} % interval {:.6g} to {:.6g}\n", c.name, c.value,
                 100 * result.confidence, c.lower, c.upper);
    }
  }
}

int run_identify_thrust(const IdentifyThrustOptions& options, const CommonOptions& common) {
  refuse_to_replace(common, common.json);
  refuse_folder(common, options.report);
  const ThrustData data = load_thrust_data(options.file, options.rotors);
  const ThrustIdentification result = identify_thrust(data, options.confidence);
  const ThrustResult described = {options, data, result};
  const files::Node node = result_of("identify-thrust", {options.file}, std::nullopt, described);
  if (common.prints_text()) print(data, result);
  write_result(common, node);
  if (!options.report.empty()) {
    const std::string path = write_thrust_report(data, result, node, options.report, common.force);
    if (common.prints_text()) fmt::print("\nreport: {}\n", path);
  }
  if (described.is_determined()) {
    if (common.prints_text()) fmt::print("\nWrite c00 .. c11 into [vehicle.thrust] of model.toml; then:\n");
    print_next(common, {"compare", "model.toml", "flights"});
  }
  return described.is_determined() ? kDone : kInconclusive;
}

}  // namespace

Command identify_thrust_command() {
  return {
      "identify-thrust", "Fit the calibration polynomials of motors and battery to load-cell data",
      "The CSV names its columns in the first line: pwm, vbat, thrust_gf (of one rotor), and optionally run, "
      "which\n"
      "numbers the ramps. Units: pwm[counts], pwm[ratio], vbat[V], vbat[mV], thrust[gf], thrust[N].\n"
      "Exit 0 if the data determine all three polynomials, 4 if not (the output says what is missing).\n\n"
      "Example: swarmcert identify-thrust load_cell.csv --rotors 4 --json thrust.json",
      [](CLI::App& app) {
        const auto options = std::make_shared<IdentifyThrustOptions>();
        app.add_option("CSV", options->file, "Load-cell recording")->required();
        app.add_option("--rotors", options->rotors,
                       "Number of rotors whose thrust the load cell measures together (default: 1)")
            ->check(CLI::Range(1, controller::kMostRotors));
        app.add_option("--confidence", options->confidence,
                       "Confidence level of the coefficients' intervals (default: 0.95)")
            ->check(CLI::Range(0.5, 0.9999));
        add_output(app, "--report", options->report, "Write an HTML report with plots into this folder");
        return [options](const CommonOptions& common) { return run_identify_thrust(*options, common); };
      },
      fields_of<ThrustResult>()};
}

}  // namespace swarmcert::analysis
