#include "analysis/commands/shared/effect_output.h"

#include <fmt/core.h>

namespace swarmcert::analysis {

files::Json values_json(const std::map<std::string, double>& values,
                        const std::map<std::string, std::pair<double, double>>& intervals) {
  files::Json json = files::Json::object();
  for (const auto& [name, value] : values) {
    files::Json& entry = json[name] = {{"value", value}};
    const auto interval = intervals.find(name);
    if (interval != intervals.end()) entry["interval_90"] = {interval->second.first, interval->second.second};
  }
  return json;
}

void print_values(const std::string& prefix, const std::map<std::string, double>& values,
                  const std::map<std::string, std::pair<double, double>>& intervals) {
  for (const auto& [name, value] : values) {
    const auto interval = intervals.find(name);
    fmt::print("{}{} = {:.4g}", prefix, name, value);
    if (interval != intervals.end())
      fmt::print(", 90 % {:.4g} .. {:.4g}", interval->second.first, interval->second.second);
    fmt::print("\n");
  }
}

}  // namespace swarmcert::analysis
