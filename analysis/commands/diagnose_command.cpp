#include <fmt/core.h>

#include <cmath>
#include <memory>

#include "analysis/commands/flight_options.h"
#include "analysis/identification/diagnose.h"
#include "analysis/progress.h"

namespace swarmcert::analysis {
namespace {

using identification::Diagnosis;
using identification::Missing;

struct Options {
  FlightOptions flights;
};

constexpr const char* kDetectableMeaning =
    "the smallest size that these flights would have shown with 90 % probability, computed from the blocks' "
    "scatter; "
    "nothing_missing means none above these sizes";

files::Json json_of(const Missing& missing) {
  const identification::Finding& finding = missing.finding;
  files::Json parameters = files::Json::object();
  for (const auto& [name, value] : missing.spec.parameters) {
    files::Json& entry = parameters[name] = {{"value", value}};
    const auto interval = missing.spec.fit.interval.find(name);
    if (interval != missing.spec.fit.interval.end())
      entry["interval_90"] = {interval->second.first, interval->second.second};
  }
  files::Json model_form = files::Json::array();
  for (const auto& [lower, upper] : finding.model_form) model_form.push_back({lower, upper});
  return {{"effect", missing.effect},
          {"kind", missing.kind},
          {"rmse_before", finding.rmse_before_N},
          {"rmse_after", finding.rmse_after_N},
          {"drop", 1 - finding.rmse_after_N / finding.rmse_before_N},
          {"drop_ci", {finding.drop_interval.first, finding.drop_interval.second}},
          {"parameters", std::move(parameters)},
          {"model_form", std::move(model_form)},
          {"class", missing.equivalence_class},
          {"confounded_with", finding.confounded_with},
          {"separated_by", missing.excitation},
          {"paired_z", finding.paired_z},
          {"wald_z", finding.wald_z},
          {"records_in_support", finding.support.records},
          {"blocks_in_support", finding.support.blocks}};
}

void print(const Diagnosis& diagnosis) {
  fmt::print("Vehicles of kind {}: {} records, {} blocks of 2 s.\n", diagnosis.kind, diagnosis.records,
             diagnosis.blocks);
  if (diagnosis.inconclusive) {
    fmt::print("  Too few for an answer: at least ten blocks are needed.\n");
    return;
  }
  if (diagnosis.ranking.empty()) fmt::print("  No effect of the library is missing above the sizes below.\n");
  for (const Missing& missing : diagnosis.ranking) {
    const identification::Finding& finding = missing.finding;
    fmt::print("  {:<15} RMSE {:.5f} -> {:.5f} N ({:.1f} %, 90 %: {:.1f} .. {:.1f})\n", missing.effect,
               finding.rmse_before_N, finding.rmse_after_N,
               100 * (1 - finding.rmse_after_N / finding.rmse_before_N), 100 * finding.drop_interval.first,
               100 * finding.drop_interval.second);
    for (const auto& [name, value] : missing.spec.parameters) {
      const auto interval = missing.spec.fit.interval.find(name);
      if (interval == missing.spec.fit.interval.end())
        fmt::print("    {} = {:.4g}\n", name, value);
      else
        fmt::print("    {} = {:.4g}, 90 % {:.4g} .. {:.4g}\n", name, value, interval->second.first,
                   interval->second.second);
    }
    if (missing.equivalence_class != missing.effect)
      fmt::print("    flights cannot tell apart: {}\n", missing.equivalence_class);
    for (const std::string& rival : finding.confounded_with)
      fmt::print("    these flights cannot tell it from {}; what would: {}\n", rival, missing.excitation);
  }
  const identification::Remainder& rest = diagnosis.remainder;
  fmt::print("  Left: {:.5f} N; low frequencies {:.1f} times the noise floor{}", diagnosis.rmse_after_N,
             rest.ratio, rest.flag ? ": not everything is explained" : "");
  for (std::size_t i = 0; i < rest.depends_on.size(); ++i)
    fmt::print("{}{}", i == 0 ? ", depends on " : ", ", rest.depends_on[i]);
  fmt::print("\n  Would have been seen in 9 of 10 cases, if at least as large as:\n");
  for (const identification::Detectable& entry : diagnosis.detectable) {
    if (std::isfinite(entry.size))
      fmt::print("    {} {} = {:.3g}\n", entry.effect, entry.parameter, entry.size);
    else
      fmt::print("    {} {}: not at any size; fly {}\n", entry.effect, entry.parameter, entry.excitation);
  }
}

int run(const Options& options, const CommonOptions& common) {
  refuse_to_replace(common, common.json);
  const residuals::Inputs inputs = read_flights(options.flights);
  files::Json result = result_head("diagnose", inputs.files());
  files::Json ranking = files::Json::array(), detectable = files::Json::array(), kinds = files::Json::array();
  bool flag = false, inconclusive = true;
  double ratio = 0;
  files::Json depends_on = files::Json::array();
  for (const stability::Model& model : inputs.models) {
    Progress progress(common.quiet);
    const Diagnosis diagnosis =
        identification::diagnose(inputs, model.kind, identification::every_flight(inputs), common.jobs,
                                 [&](int done, int total) { progress.show(done, total, "flights"); });
    if (common.prints_text()) print(diagnosis);
    inconclusive = inconclusive && diagnosis.inconclusive;
    for (const Missing& missing : diagnosis.ranking) ranking.push_back(json_of(missing));
    for (const identification::Detectable& entry : diagnosis.detectable) {
      detectable.push_back(
          {{"effect", entry.effect},
           {"kind", diagnosis.kind},
           {"parameter", entry.parameter},
           {"size", std::isfinite(entry.size) ? files::Json(entry.size) : files::Json(nullptr)},
           {"excitation", entry.excitation}});
    }
    const identification::Remainder& rest = diagnosis.remainder;
    flag = flag || rest.flag;
    ratio = std::max(ratio, rest.ratio);
    for (const std::string& variable : rest.depends_on) depends_on.push_back(variable);
    kinds.push_back({{"kind", diagnosis.kind},
                     {"records", diagnosis.records},
                     {"blocks", diagnosis.blocks},
                     {"rmse_before", diagnosis.rmse_before_N},
                     {"rmse_after", diagnosis.rmse_after_N}});
  }
  result["verdict"] = inconclusive ? "inconclusive" : ranking.empty() ? "nothing_missing" : "missing_effect";
  result["ranking"] = std::move(ranking);
  result["unexplained"] = {{"flag", flag}, {"ratio", ratio}, {"depends_on", std::move(depends_on)}};
  result["detectable"] = std::move(detectable);
  result["detectable_meaning"] = kDetectableMeaning;
  result["kinds"] = std::move(kinds);
  write_result(common, result);
  return inconclusive ? kInconclusive : kDone;
}

}  // namespace

Command diagnose_command() {
  return {"diagnose", "Which physical effect is missing in a model, judged by flights",
          "Every known effect is a candidate; one counts as found if it lowers the cross-validated error by "
          "2 % and\n"
          "stands out from the scatter between blocks of 2 s. What remains is tested separately.\n\n"
          "Example: swarmcert diagnose stability/models/crazyflie-small.toml flights/",
          [](CLI::App& app) {
            const auto options = std::make_shared<Options>();
            declare_flights(app, options->flights, true);
            return [options](const CommonOptions& common) { return run(*options, common); };
          }};
}

}  // namespace swarmcert::analysis
