#include "analysis/commands/shared/effect_output.h"

#include <fmt/core.h>

#include "stability/effects/registry.h"

namespace swarmcert::analysis {

double shown_beyond_file(const std::string& effect, const std::string& parameter) {
  return stability::traits_of(effect).is_plain(stability::Family::kThrustScale) && parameter == "ratio" ? 1
                                                                                                        : 0;
}

std::string interval_words(const std::string& effect, const std::string& parameter,
                           const std::map<std::string, Interval>& intervals) {
  const auto interval = intervals.find(parameter);
  if (interval == intervals.end()) return "";
  const double beyond = shown_beyond_file(effect, parameter);
  return fmt::format("{:.4g} .. {:.4g}", beyond + interval->second.lower, beyond + interval->second.upper);
}

void describe(files::Record& record, const FittedValue& fitted) {
  record.field("value", fitted.value, "", "", "estimate");
  record.may("interval_90", fitted.interval_90, "90 % interval.");
}

FittedValues fitted_values(const std::string& effect, const std::map<std::string, double>& values,
                           const std::map<std::string, Interval>& intervals) {
  FittedValues fitted;
  for (const auto& [name, value] : values) {
    const double beyond = shown_beyond_file(effect, name);
    fitted[name].value = beyond + value;
    const auto interval = intervals.find(name);
    if (interval != intervals.end())
      fitted[name].interval_90 = {beyond + interval->second.lower, beyond + interval->second.upper};
  }
  return fitted;
}

bool is_sensor_error(const std::string& effect) {
  return stability::traits_of(effect).place == stability::Place::kLog;
}

std::string sensor_words(const std::string& effect) {
  return effect + " is an error of a sensor, not a force on the vehicle.";
}

void describe_effect(files::Record& record, const stability::EffectSpec& effect) {
  record.field("effect", effect.name, "Name in model files.");
  record.field("parameters", fitted_values(effect.name, effect.parameters, effect.fit.interval),
               "Fitted values; units stand in the names.");
  record.may("sensor",
             !effect.name.empty() && is_sensor_error(effect.name) ? std::optional(true) : std::nullopt,
             "An error of a sensor, not a force on the vehicle.");
  record.may("vehicle", effect.vehicle.empty() ? std::nullopt : std::optional(effect.vehicle),
             "The one vehicle that has it; absent: all.");
}

void print_values(const std::string& effect, const std::string& prefix,
                  const std::map<std::string, double>& values,
                  const std::map<std::string, Interval>& intervals) {
  for (const auto& [name, value] : values) {
    const std::string interval = interval_words(effect, name, intervals);
    fmt::print("{}{} = {:.4g}{}\n", prefix, name, shown_beyond_file(effect, name) + value,
               interval.empty() ? "" : ", 90 % " + interval);
  }
}

}  // namespace swarmcert::analysis
