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

files::Json values_json(const std::string& effect, const std::map<std::string, double>& values,
                        const std::map<std::string, Interval>& intervals) {
  files::Json json = files::Json::object();
  for (const auto& [name, value] : values) {
    const double beyond = shown_beyond_file(effect, name);
    files::Json& entry = json[name] = {{"value", beyond + value}};
    const auto interval = intervals.find(name);
    if (interval != intervals.end())
      entry["interval_90"] = {beyond + interval->second.lower, beyond + interval->second.upper};
  }
  return json;
}

bool is_sensor_error(const std::string& effect) {
  return stability::traits_of(effect).place == stability::Place::kLog;
}

std::string sensor_words(const std::string& effect) {
  return effect + " is an error of a sensor, not a force on the vehicle.";
}

files::Json effects_json(const std::vector<stability::EffectSpec>& effects) {
  files::Json json = files::Json::array();
  for (const stability::EffectSpec& effect : effects) {
    files::Json entry = {{"effect", effect.name},
                         {"parameters", values_json(effect.name, effect.parameters, effect.fit.interval)}};
    if (is_sensor_error(effect.name)) entry["sensor"] = true;
    if (!effect.vehicle.empty()) entry["vehicle"] = effect.vehicle;
    json.push_back(std::move(entry));
  }
  return json;
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
