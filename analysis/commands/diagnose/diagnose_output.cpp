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
  const bool is_open = !diagnosis.ranking.empty() || identification::leaves_something(diagnosis);
  if (!diagnosis.has_set_points && is_open && diagnosis.too_poor.empty())
    add("with the set points in the log: they tell what the controller answered from what it caused");
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
