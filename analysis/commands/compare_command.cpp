#include <fmt/core.h>

#include <cmath>
#include <memory>

#include "analysis/commands/flight_options.h"
#include "analysis/compare_report.h"
#include "analysis/progress.h"
#include "analysis/residuals/comparison.h"

namespace swarmcert::analysis {
namespace {

using analysis::json_of;
using residuals::Comparison;

struct Options {
  FlightOptions flights;
  std::string report;
};

files::Json json_of(const Eigen::Vector3d& v) {
  // JSON has no NaN: null where a spectrum could not be had.
  const auto number = [](double x) { return std::isfinite(x) ? files::Json(x) : files::Json(nullptr); };
  return {{"x", number(v[0])}, {"y", number(v[1])}, {"z", number(v[2])}};
}

files::Json json_of(const residuals::ErrorStatistics& s) {
  return {{"samples", s.samples},
          {"rmse", json_of(s.rmse)},
          {"bias", json_of(s.bias)},
          {"p95", json_of(s.p95)},
          {"p999", json_of(s.p999)},
          {"max", json_of(s.max)},
          {"variance_explained", json_of(s.variance_explained)}};
}

files::Json json_of(const residuals::GroupErrors& g) {
  files::Json json = json_of(g.statistics);
  const char* const kAxes[] = {"x", "y", "z", "total"};
  for (std::size_t k = 0; k < 4; ++k)
    json["rmse_interval_90"][kAxes[k]] = {g.rmse_interval[k].lower, g.rmse_interval[k].upper};
  json["nrmse"] = json_of(g.nrmse);
  json["low_band_to_floor"] = json_of(g.low_band_to_floor);
  json["noise_floor"] = json_of(g.noise_floor_N);
  return json;
}

files::Json json_of(const residuals::LearningError::Quantiles& q) {
  return {{"p50", json_of(q.p50)}, {"p95", json_of(q.p95)}, {"p99", json_of(q.p99)}, {"max", json_of(q.max)}};
}

files::Json json_of(const residuals::TrackErrors& track) {
  files::Json json = {{"flight", track.flight},
                      {"scenario", track.scenario},
                      {"vehicle", track.vehicle},
                      {"kind", track.kind},
                      {"file", track.path},
                      {"position_only", track.position_only},
                      {"clock_offset_s", track.clock_offset_s},
                      {"clock_onsets", track.clock_onsets},
                      {"findings", track.findings}};
  files::Json& records = json["records"] = files::Json::object();
  for (std::size_t k = 0; k < track.cut.size(); ++k)
    records[residuals::name(static_cast<residuals::Cut>(k))] = track.cut[k];
  json.update(json_of(track.errors));
  return json;
}

files::Json groups(const std::map<std::string, residuals::GroupErrors>& members) {
  files::Json json = files::Json::object();
  for (const auto& [name, errors] : members) json[name] = json_of(errors);
  return json;
}

files::Json result_of(const Comparison& comparison, const residuals::Inputs& inputs) {
  files::Json json = result_head("compare", inputs.files());
  json["unit"] = "N";
  json["overall"] = json_of(comparison.overall);
  json["flights"] = files::Json::array();
  for (const residuals::TrackErrors& track : comparison.tracks) json["flights"].push_back(json_of(track));
  json["scenarios"] = groups(comparison.scenarios);
  json["vehicles"] = groups(comparison.vehicles);
  json["kinds"] = groups(comparison.kinds);
  json["regions"] = files::Json::array();
  for (const residuals::RegionErrors& region : comparison.regions) {
    files::Json entry = {{"variable", residuals::variable_name(region.variable)},
                         {"words", region.words},
                         {"share", region.share}};
    entry.update(json_of(region.statistics));
    json["regions"].push_back(std::move(entry));
  }
  json["moments"] = files::Json::array();
  for (const residuals::Moment& moment : comparison.moments) {
    json["moments"].push_back({{"flight", moment.flight},
                               {"vehicle", moment.vehicle},
                               {"time_s", moment.time_s},
                               {"residual", json_of(moment.residual_N)}});
  }
  const residuals::LearningError& learning = comparison.learning_error;
  json["learning_error"] = {{"windows", learning.windows},
                            {"window_s", residuals::LearningError::kWindow_s},
                            {"bandwidth_hz", residuals::LearningError::kBandwidth_hz},
                            {"bias", json_of(learning.bias_N)},
                            {"amplitude", json_of(learning.amplitude_N)},
                            {"rate", json_of(learning.rate_N_s)},
                            {"variation", json_of(learning.variation_N)},
                            {"impulse", json_of(learning.impulse_N_s)}};
  json["torque"] =
      "refused: logs at 100 Hz of a loop at 500 Hz alias; the inertia they give is wrong by a factor of 28";
  json["problems"] = comparison.problems;
  json["skipped_files"] = inputs.found.skipped;
  return json;
}

void print(const Comparison& comparison, const residuals::Inputs& inputs) {
  constexpr double kGramForce_N = stability::kGramForce_N;
  for (const stability::Model& model : inputs.models) {
    fmt::print("Model {}: {}, {:.1f} g, {} effects\n", model.path, model.kind, 1000 * model.mass_kg,
               model.effects.size());
  }
  fmt::print(
      "{} flights; force residual f_a = m a - model, in the world. The torque is not compared: logs at 100 "
      "Hz\n"
      "of a loop at 500 Hz alias.\n\n",
      inputs.found.flights.size());
  fmt::print("{:<28}{:>9}{:>22}{:>22}{:>10}{:>9}\n", "", "records", "RMSE x y z [gf]", "bias x y z [gf]",
             "p99.9 z", "max z");
  const auto line = [&](const std::string& name, const residuals::GroupErrors& group) {
    const residuals::ErrorStatistics& s = group.statistics;
    fmt::print("{:<28}{:>9}{:>8.2f}{:>7.2f}{:>7.2f}{:>8.2f}{:>7.2f}{:>7.2f}{:>10.2f}{:>9.2f}\n", name,
               s.samples, s.rmse.x / kGramForce_N, s.rmse.y / kGramForce_N, s.rmse.z / kGramForce_N,
               s.bias.x / kGramForce_N, s.bias.y / kGramForce_N, s.bias.z / kGramForce_N,
               s.p999.z / kGramForce_N, s.max.z / kGramForce_N);
  };
  for (const auto& [name, errors] : comparison.scenarios) line(name, errors);
  for (const auto& [name, errors] : comparison.vehicles) line(name, errors);
  line("all", comparison.overall);
  const auto& interval = comparison.overall.rmse_interval;
  fmt::print("\nRMSE of all: {:.4f} N, 90 % interval {:.4f} .. {:.4f}; {:.1f} % of the weight.\n",
             comparison.overall.statistics.rmse.total, interval[3].lower, interval[3].upper,
             100 * comparison.overall.nrmse.total);
  fmt::print("\nWhere it fails most:\n");
  for (std::size_t i = 0; i < comparison.regions.size() && i < 8; ++i) {
    const residuals::RegionErrors& region = comparison.regions[i];
    fmt::print("  {} ({} records)\n", region.words, region.statistics.samples);
  }
  if (!comparison.moments.empty()) {
    const residuals::Moment& worst = comparison.moments[0];
    fmt::print("Worst moment: {} {} at {:.2f} s, {:.2f} gf\n", worst.flight, worst.vehicle, worst.time_s,
               worst.residual_N.norm() / kGramForce_N);
  }
  for (const std::string& problem : comparison.problems) fmt::print("left out: {}\n", problem);
  if (!inputs.found.skipped.empty())
    fmt::print("{} files are no logs and were skipped\n", inputs.found.skipped.size());
}

int run(const Options& options, const CommonOptions& common) {
  refuse_to_replace(common, common.json);
  const residuals::Inputs inputs = read_flights(options.flights);
  Progress progress(common.quiet);
  const Comparison comparison = residuals::compare(
      inputs, common.jobs, [&](int done, int total) { progress.show(done, total, "flights"); });
  write_result(common, result_of(comparison, inputs));
  if (common.prints_text()) print(comparison, inputs);
  if (!options.report.empty()) {
    const std::string path = write_compare_report(comparison, inputs, options.report, common.force);
    if (common.prints_text()) fmt::print("Report: {}\n", path);
  }
  if (comparison.overall.statistics.samples > 0) return kDone;
  fmt::print(stderr,
             "no usable record: nothing was compared; 'swarmcert inspect LOG' says what is in a log\n");
  return kInconclusive;
}

}  // namespace

Command compare_command() {
  return {
      "compare", "A model against flights: force residuals, and where the model fails",
      "Records on the ground, after a crash, with rotors off, after gaps and without a known neighbour are "
      "cut;\n"
      "the result counts them. Forces are in newton in the JSON, in gram-force on the terminal.\n\n"
      "Example: swarmcert compare stability/models/crazyflie-small.toml flights/ --report out",
      [](CLI::App& app) {
        const auto options = std::make_shared<Options>();
        declare_flights(app, options->flights, true);
        app.add_option("--report", options->report, "Write an HTML report into this folder");
        app.add_flag(
            "--published-filter", options->flights.published_filter,
            "Cut and filter as the networks' authors did: thrust lag 0.16 per record, clocks as they are, "
            "|f_a,z| < 50 gf");
        return [options](const CommonOptions& common) { return run(*options, common); };
      }};
}

}  // namespace swarmcert::analysis
