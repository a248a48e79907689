#include "analysis/commands/diagnose/diagnose_output.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "analysis/commands/diagnose/remainder_output.h"
#include "analysis/commands/shared/effect_output.h"
#include "analysis/identification/verdict.h"

namespace swarmcert::analysis {
namespace {

using identification::Diagnosis;
using identification::Missing;

void print(const Missing& missing, int flights, const residuals::ForceUnit& unit) {
  const identification::Finding& finding = missing.finding;
  fmt::print("  {:<15} RMSE {:.4g} -> {:.4g} {} ({:.1f} %, 90 %: {:.1f} .. {:.1f})\n", missing.effect,
             unit.per_newton() * finding.rmse_before_N, unit.per_newton() * finding.rmse_after_N, unit.name,
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

}  // namespace

std::string varies_with(const Diagnosis& diagnosis) {
  const auto& entries = diagnosis.scan.entries;
  return entries.empty() || entries[0].share < identification::kMuchOfForce ? "" : entries[0].variable;
}

std::vector<std::string> left_sentences(const Diagnosis& diagnosis, const residuals::ForceUnit& unit) {
  std::vector<std::string> sentences;
  for (const std::string& effect : diagnosis.suspected) {
    const std::vector<std::string>& at_bound = diagnosis.at_bound;
    sentences.push_back(
        fmt::format("Not counted: {} {}.", effect,
                    std::find(at_bound.begin(), at_bound.end(), effect) != at_bound.end()
                        ? "ends at its bound: not identified"
                        : "fits, but another form explains more, or it does not lower the error of held-out "
                          "blocks"));
  }
  if (diagnosis.thrust_scale.is_known) {
    const identification::InstrumentedValue& scale = diagnosis.thrust_scale.value;
    sentences.push_back(fmt::format(
        "Thrust scale: {:.3f} by least squares, {:.3f} by instrument (90 %: {:.3f} .. {:.3f}).",
        1 + scale.least_squares, 1 + scale.instrument, 1 + scale.interval.lower, 1 + scale.interval.upper));
  }
  const identification::Remainder& rest = diagnosis.remainder;
  sentences.push_back(
      fmt::format("Left: {:.4g} {} (noise {:.3g}); {}.", unit.per_newton() * diagnosis.rmse_after_N,
                  unit.name, unit.per_newton() * std::sqrt(rest.floor_N2),
                  varies_with(diagnosis).empty() && !rest.stands_out() ? "nothing stands out"
                                                                       : "not everything is explained"));
  if (rest.line.is_found())
    sentences.push_back(fmt::format("A vibration at {:.1f} Hz is {:.0f} % of what is left along {}.",
                                    rest.line.frequency_hz, 100 * rest.line.share, "xyz"[rest.line.axis]));
  return sentences;
}

void print_diagnosis(const Diagnosis& diagnosis, const residuals::ForceUnit& unit) {
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
  if (diagnosis.ranking.empty()) fmt::print("  {}\n", no_effect_words(diagnosis));
  for (const Missing& missing : diagnosis.ranking) print(missing, diagnosis.flights, unit);
  for (const std::string& sentence : left_sentences(diagnosis, unit)) fmt::print("  {}\n", sentence);
  print_remainder(diagnosis, unit);
  fmt::print("  {}:\n", kDetectableWords);
  for (const evidence::Detectable& entry : diagnosis.detectable) {
    if (std::isfinite(entry.size))
      fmt::print("    {} {} = {:.3g}\n", entry.effect, entry.parameter, entry.size);
    else
      fmt::print("    {} {}: not at any size; fly {}\n", entry.effect, entry.parameter, entry.excitation);
  }
}

std::string no_effect_words(const Diagnosis& diagnosis) {
  return identification::leaves_something(diagnosis)
             ? "No effect of the library explains the remainder."
             : "No effect of the library is missing above the sizes below.";
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

std::vector<std::string> next_flights(const Diagnosis& diagnosis, bool wants_all) {
  std::vector<std::string> next;
  const auto add = [&next](const std::string& flight) {
    if (!flight.empty() && std::find(next.begin(), next.end(), flight) == next.end()) next.push_back(flight);
  };
  const bool is_open = !diagnosis.ranking.empty() || identification::leaves_something(diagnosis);
  if (!diagnosis.has_set_points && is_open && diagnosis.too_poor.empty())
    add("with the set points in the log: they tell what the controller answered from what it caused");
  for (const Missing& missing : diagnosis.ranking) {
    for (const identification::Rival& rival : missing.finding.rivals)
      add(fmt::format("to separate {} from {}: {}; {}", missing.effect, rival.effect, missing.excitation,
                      rival.excitation));
  }
  for (const evidence::Detectable& entry : diagnosis.detectable) {
    if (wants_all && !std::isfinite(entry.size))
      add(fmt::format("to see {} at all: {}", entry.effect, entry.excitation));
  }
  return next;
}

}  // namespace swarmcert::analysis
