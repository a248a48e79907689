#include <fmt/core.h>

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

constexpr const char* kNames[] = {"thrust", "pwm", "max_thrust"};

files::Json to_json(const PolynomialFit& fit) {
  files::Json json = {{"determined", fit.determined},
                      {"method", fit.method},
                      {"unit", fit.unit},
                      {"samples", fit.samples},
                      {"residual_rms", fit.residual_rms},
                      {"largest_residual", fit.largest_residual},
                      {"largest_uncertainty", fit.largest_uncertainty}};
  if (!fit.determined) json["why_not"] = fit.why_not;
  return json;
}

files::Json to_json(const SignalSource& source) { return {{"column", source.column}, {"unit", source.unit}}; }

void print(const ThrustData& data, const ThrustIdentification& result) {
  fmt::print("{}: {} rows, PWM {:.2f} to {:.2f} of full, battery {:.2f} to {:.2f} V\n", data.path,
             data.samples.size(), result.smallest_p, result.largest_p,
             result.smallest_v * controller::kReferenceVoltage_V,
             result.largest_v * controller::kReferenceVoltage_V);
  fmt::print("pwm: '{}' in {}; voltage: '{}' in {}; thrust: '{}' in {}\n", data.pwm.column, data.pwm.unit,
             data.voltage.column, data.voltage.unit, data.thrust.column, data.thrust.unit);
  constexpr const char* kFormulas[] = {"gf of one rotor = c00 + c10 p + c01 v + c20 p^2 + c11 p v",
                                       "p = d00 + d10 g + d01 v + d20 g^2 + d11 g v",
                                       "largest gf of one rotor = e00 + e10 p + e01 v"};
  const PolynomialFit* const fits[] = {&result.thrust, &result.pwm, &result.max_thrust};
  for (int i = 0; i < 3; ++i) {
    const PolynomialFit& fit = *fits[i];
    fmt::print("\n{}   (p = PWM / 65536, v = V / 4.2)\n", kFormulas[i]);
    if (!fit.determined) {
      fmt::print("  not determined: {}\n", fit.why_not);
      continue;
    }
    fmt::print("  {}; residual rms {:.4g} {}, largest {:.4g}\n", fit.method, fit.residual_rms, fit.unit,
               fit.largest_residual);
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
  const bool determined = result.thrust.determined && result.pwm.determined && result.max_thrust.determined;

  files::Json json = result_head("identify-thrust", {options.file});
  json["verdict"] = determined ? "determined" : "undetermined";
  json["columns"] = {
      {"pwm", to_json(data.pwm)}, {"voltage", to_json(data.voltage)}, {"thrust", to_json(data.thrust)}};
  json["rotors"] = options.rotors;
  json["samples"] = data.samples.size();
  json["confidence"] = options.confidence;
  json["range"] = {{"p", {result.smallest_p, result.largest_p}},
                   {"battery_V",
                    {result.smallest_v * controller::kReferenceVoltage_V,
                     result.largest_v * controller::kReferenceVoltage_V}}};
  json["coefficients"] = files::Json::object();
  json["fits"] = files::Json::object();
  const PolynomialFit* const fits[] = {&result.thrust, &result.pwm, &result.max_thrust};
  for (int i = 0; i < 3; ++i) {
    json["fits"][kNames[i]] = to_json(*fits[i]);
    for (const Coefficient& c : fits[i]->coefficients) {
      json["coefficients"][c.name] = {{"value", c.value}, {"interval", {c.lower, c.upper}}};
    }
  }
  if (common.prints_text()) print(data, result);
  write_result(common, json);
  if (!options.report.empty()) {
    const std::string path = write_thrust_report(data, result, json, options.report, common.force);
    if (common.prints_text()) fmt::print("\nreport: {}\n", path);
  }
  return determined ? kDone : kInconclusive;
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
      }};
}

}  // namespace swarmcert::analysis
