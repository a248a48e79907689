#include "analysis/commands/diagnose/diagnose_output.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "analysis/commands/diagnose/remainder_output.h"
#include "analysis/commands/shared/effect_output.h"
#include "analysis/identification/verdict.h"
#include "nn/base/json_number.h"

namespace swarmcert::analysis {
namespace {

using identification::Diagnosis;
using identification::Missing;

constexpr const char* kDetectableMeaning =
    "the smallest size that these flights show in 90 % of injections (open loop: column times size is added "
    "to the residual of resampled blocks; the flight does not react); null: not at any size within the "
    "physical bounds; nothing_missing means none above these sizes, and nothing left above three times the "
    "noise floor";

files::Json json_of(const identification::InstrumentedValue& value, double beyond) {
  return {{"least_squares", beyond + value.least_squares},
          {"instrument", beyond + value.instrument},
          {"interval_90", {beyond + value.interval.lower, beyond + value.interval.upper}},
          {"difference_z", value.difference_z},
          {"verdict", !value.is_strong()    ? "too_weak"
                      : value.contradicts() ? "contradicts"
                                            : "agrees"}};
}

/// Effects that no flight can tell apart, followed by those that these flights cannot tell apart.
std::string class_of(const Missing& missing) {
  std::string all = missing.equivalence_class;
  for (const identification::Rival& rival : missing.finding.rivals) all += " / " + rival.effect;
  return all;
}

files::Json json_of(const Missing& missing) {
  const identification::Finding& finding = missing.finding;
  files::Json model_form = files::Json::object(), instrument = files::Json::object();
  for (std::size_t c = 0; c < missing.coefficients.size(); ++c) {
    const std::string& name = missing.coefficients[c];
    const double beyond = shown_beyond_file(missing.effect, name);
    if (c < finding.model_form.size())
      model_form[name] = {beyond + finding.model_form[c].lower, beyond + finding.model_form[c].upper};
    if (c < missing.instrument.size()) instrument[name] = json_of(missing.instrument[c], beyond);
  }
  files::Json rivals = files::Json::array();
  for (const identification::Rival& rival : finding.rivals)
    rivals.push_back({{"effect", rival.effect}, {"fly", rival.excitation}});
  files::Json json = {{"effect", missing.effect},
                      {"kind", missing.kind},
                      {"rmse_before", finding.rmse_before_N},
                      {"rmse_after", finding.rmse_after_N},
                      {"drop", 1 - finding.rmse_after_N / finding.rmse_before_N},
                      {"drop_ci", finding.drop_interval},
                      {"parameters", values_json(missing.effect, missing.parameters, missing.intervals)},
                      {"per_vehicle", !missing.specs.empty() && !missing.specs[0].vehicle.empty()},
                      {"model_form", std::move(model_form)},
                      {"instrument", std::move(instrument)},
                      {"class", class_of(missing)},
                      {"confounded_with", finding.confounded_with()},
                      {"rivals", std::move(rivals)},
                      {"separated_by", missing.excitation},
                      {"paired_z", finding.paired_z},
                      {"wald_z", finding.wald_z},
                      {"records_in_support", finding.support.records},
                      {"blocks_in_support", finding.support.blocks},
                      {"flights_in_support", finding.support.flights}};
  if (is_sensor_error(missing.effect)) json["sensor"] = true;
  return json;
}

void print(const Missing& missing, int flights) {
  const identification::Finding& finding = missing.finding;
  fmt::print("  {:<15} RMSE {:.5f} -> {:.5f} N ({:.1f} %, 90 %: {:.1f} .. {:.1f})\n", missing.effect,
             finding.rmse_before_N, finding.rmse_after_N,
             100 * (1 - finding.rmse_after_N / finding.rmse_before_N), 100 * finding.drop_interval.lower,
             100 * finding.drop_interval.upper);
  if (is_sensor_error(missing.effect)) fmt::print("    {}\n", sensor_words(missing.effect));
  print_values(missing.effect, "    ", missing.parameters, missing.intervals);
  for (std::size_t c = 0; c < missing.instrument.size(); ++c) {
    const identification::InstrumentedValue& value = missing.instrument[c];
    if (!value.is_strong()) continue;
    const double beyond = shown_beyond_file(missing.effect, missing.coefficients[c]);
    fmt::print("    by instrument (set points) {} = {:.4g}, 90 % {:.4g} .. {:.4g}\n", missing.coefficients[c],
               beyond + value.instrument, beyond + value.interval.lower, beyond + value.interval.upper);
  }
  if (flights > 1 && finding.support.flights == 1) fmt::print("    seen in 1 flight of {}\n", flights);
  if (missing.equivalence_class != missing.effect)
    fmt::print("    flights cannot tell apart: {}\n", missing.equivalence_class);
  for (const identification::Rival& rival : finding.rivals)
    fmt::print("    these flights cannot distinguish it from {}; flights that would: {}; {}\n", rival.effect,
               missing.excitation, rival.excitation);
}

files::Json json_of(const Diagnosis& diagnosis) {
  files::Json kind = {{"kind", diagnosis.kind},
                      {"records", diagnosis.records},
                      {"blocks", diagnosis.blocks},
                      {"searched_blocks", diagnosis.searched_blocks},
                      {"flights", diagnosis.flights},
                      {"rmse_before", diagnosis.rmse_before_N},
                      {"rmse_after", diagnosis.rmse_after_N},
                      {"too_poor", diagnosis.too_poor},
                      {"closed_loop_artefacts", diagnosis.contradicted},
                      {"suspected", diagnosis.suspected},
                      {"at_bound", diagnosis.at_bound}};
  if (diagnosis.thrust_scale.is_known) {
    const identification::InstrumentedValue& scale = diagnosis.thrust_scale.value;
    kind["thrust_scale"] = {{"least_squares", 1 + scale.least_squares},
                            {"instrument", 1 + scale.instrument},
                            {"interval_90", {1 + scale.interval.lower, 1 + scale.interval.upper}},
                            {"difference_z", scale.difference_z}};
  }
  return kind;
}

files::Json json_of(const identification::Detectable& entry, const std::string& kind) {
  return {{"effect", entry.effect},       {"kind", kind},
          {"parameter", entry.parameter}, {"size", files::finite(entry.size)},
          {"shape", entry.shape},         {"excitation", entry.excitation}};
}

}  // namespace

void print_diagnosis(const Diagnosis& diagnosis) {
  fmt::print(
      "{} {}: {} records, {} blocks of 2 s.\n", diagnosis.vehicle.empty() ? "Vehicles of kind" : "Vehicle",
      diagnosis.vehicle.empty() ? diagnosis.kind : diagnosis.vehicle, diagnosis.records, diagnosis.blocks);
  if (diagnosis.searched_blocks < diagnosis.blocks && diagnosis.too_poor.empty())
    fmt::print(
        "  Effects were selected on {} of the blocks, spread over the flights; their numbers use all "
        "blocks.\n",
        diagnosis.searched_blocks);
  if (!diagnosis.too_poor.empty()) {
    fmt::print("  No answer: {}.\n", diagnosis.too_poor);
    return;
  }
  if (diagnosis.ranking.empty()) {
    fmt::print("  {}\n", diagnosis.remainder.stands_out()
                             ? "No effect of the library explains the remainder."
                             : "No effect of the library is missing above the sizes below.");
  }
  for (const Missing& missing : diagnosis.ranking) print(missing, diagnosis.flights);
  for (const std::string& effect : diagnosis.contradicted) {
    fmt::print(
        "  Not counted: {} fits, but not along the set points: it is the controller's response to something "
        "else\n",
        effect);
  }
  for (const std::string& effect : diagnosis.suspected) {
    const std::vector<std::string>& at_bound = diagnosis.at_bound;
    fmt::print("  Not counted: {} {}\n", effect,
               std::find(at_bound.begin(), at_bound.end(), effect) != at_bound.end()
                   ? "ends at its bound: not identified"
                   : "fits, but explains little of the remainder, another form explains more, or set points "
                     "do not confirm it");
  }
  if (diagnosis.thrust_scale.is_known) {
    const identification::InstrumentedValue& scale = diagnosis.thrust_scale.value;
    fmt::print("  Thrust scale: {:.3f} by least squares, {:.3f} by instrument (90 %: {:.3f} .. {:.3f})\n",
               1 + scale.least_squares, 1 + scale.instrument, 1 + scale.interval.lower,
               1 + scale.interval.upper);
  }
  const identification::Remainder& rest = diagnosis.remainder;
  fmt::print("  Left: {:.5f} N; low frequencies {:.1f} times the noise floor{}", diagnosis.rmse_after_N,
             rest.ratio, rest.stands_out() ? ": not everything is explained" : "");
  for (std::size_t i = 0; i < rest.depends_on.size(); ++i)
    fmt::print("{}{}", i == 0 ? ", depends on " : ", ", rest.depends_on[i]);
  fmt::print("\n");
  if (rest.line.is_found())
    fmt::print("  A vibration at {:.1f} Hz is {:.0f} % of what is left along {}.\n", rest.line.frequency_hz,
               100 * rest.line.share, "xyz"[rest.line.axis]);
  print_remainder(diagnosis);
  fmt::print("  Shown in 9 of 10 injections (open loop), if at least as large as:\n");
  for (const identification::Detectable& entry : diagnosis.detectable) {
    if (std::isfinite(entry.size))
      fmt::print("    {} {} = {:.3g}\n", entry.effect, entry.parameter, entry.size);
    else
      fmt::print("    {} {}: not at any size; fly {}\n", entry.effect, entry.parameter, entry.excitation);
  }
}

void add_diagnoses(const std::vector<Diagnosis>& diagnoses, files::Json& result) {
  files::Json ranking = files::Json::array(), detectable = files::Json::array(), kinds = files::Json::array();
  files::Json depends_on = files::Json::array(), left = files::Json::array();
  bool flag = false;
  double ratio = 0;
  std::vector<std::string> problems;
  for (const Diagnosis& diagnosis : diagnoses) {
    for (const std::string& problem : diagnosis.problems)
      if (std::find(problems.begin(), problems.end(), problem) == problems.end()) problems.push_back(problem);
    for (const Missing& missing : diagnosis.ranking) {
      ranking.push_back(json_of(missing));
      if (!diagnosis.vehicle.empty()) ranking.back()["vehicle"] = diagnosis.vehicle;
    }
    for (const identification::Detectable& entry : diagnosis.detectable)
      detectable.push_back(json_of(entry, diagnosis.kind));
    const identification::Remainder& rest = diagnosis.remainder;
    flag = flag || rest.stands_out();
    ratio = std::max(ratio, rest.ratio);
    for (const std::string& variable : rest.depends_on) depends_on.push_back(variable);
    for (files::Json& entry : remainder_json(diagnosis)) left.push_back(std::move(entry));
    kinds.push_back(json_of(diagnosis));
  }
  std::string reason;
  result["verdict"] = name(identification::verdict_of(diagnoses, reason));
  result["ranking"] = std::move(ranking);
  result["unexplained"] = {{"flag", flag}, {"ratio", ratio}, {"depends_on", std::move(depends_on)}};
  result["remainder"] = std::move(left);
  result["detectable"] = std::move(detectable);
  result["detectable_meaning"] = kDetectableMeaning;
  result["kinds"] = std::move(kinds);
  result["problems"] = problems;
  if (!reason.empty()) result["reason"] = reason;
}

void add_differences(const std::vector<identification::Difference>& differences,
                     const std::vector<std::string>& other_flights, files::Json& result) {
  files::Json vehicles = files::Json::array();
  for (const identification::Difference& difference : differences) {
    files::Json within = files::Json::array();
    for (const Missing& missing : difference.within_scatter) within.push_back(json_of(missing));
    vehicles.push_back({{"vehicle", difference.vehicle},
                        {"kind", difference.diagnosis.kind},
                        {"same_vehicle", difference.against_itself},
                        {"held", effects_json(difference.held)},
                        {"grouped_by", difference.grouped_by},
                        {"groups", difference.own_groups},
                        {"other_groups", difference.other_groups},
                        {"scatter_known", difference.no_scatter.empty()},
                        {"within_scatter", std::move(within)}});
  }
  result["against"] = {{"flights", other_flights}, {"vehicles", std::move(vehicles)}};
}

std::string in_words(const identification::Difference& difference) {
  std::string held;
  for (const stability::EffectSpec& spec : difference.held) held += (held.empty() ? "" : ", ") + spec.name;
  std::string text = fmt::format("Against {}: {} held fixed; ",
                                 difference.against_itself ? "its own other flights" : "the other flights",
                                 held.empty() ? "nothing beyond the model" : held);
  if (!difference.no_scatter.empty()) return text + difference.no_scatter + ".";
  text +=
      fmt::format("intervals hold the scatter of {} {}s.", difference.other_groups, difference.grouped_by);
  for (const Missing& missing : difference.within_scatter)
    text += fmt::format(" Found, but within the scatter: {}.", missing.effect);
  return text;
}

std::vector<std::string> next_flights(const Diagnosis& diagnosis) {
  std::vector<std::string> next;
  const auto add = [&next](const std::string& flight) {
    if (!flight.empty() && std::find(next.begin(), next.end(), flight) == next.end()) next.push_back(flight);
  };
  for (const Missing& missing : diagnosis.ranking) {
    for (const identification::Rival& rival : missing.finding.rivals)
      add(fmt::format("to separate {} from {}: {}; {}", missing.effect, rival.effect, missing.excitation,
                      rival.excitation));
  }
  for (const identification::Detectable& entry : diagnosis.detectable) {
    if (!std::isfinite(entry.size)) add(fmt::format("to see {} at all: {}", entry.effect, entry.excitation));
  }
  return next;
}

}  // namespace swarmcert::analysis
