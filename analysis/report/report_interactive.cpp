#include "analysis/report/report_interactive.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "analysis/report/report_text.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {
namespace {

template <class T>
std::string base64_of(const std::vector<T>& numbers) {
  return base64({reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(T)});
}

files::Json column_json(const std::vector<float>& column) {
  constexpr std::int16_t kUnknown = std::numeric_limits<std::int16_t>::min();
  constexpr double kSteps = 65534;
  float low = std::numeric_limits<float>::infinity(), high = -low;
  bool is_complete = true;
  for (const float x : column) {
    if (std::isfinite(x)) {
      low = std::min(low, x);
      high = std::max(high, x);
    } else {
      is_complete = false;
    }
  }
  if (!(low <= high)) return nullptr;
  if (low == high && is_complete) return low;
  std::vector<std::int16_t> steps;
  const double width = std::max(static_cast<double>(high) - static_cast<double>(low), 1e-30);
  for (const float x : column) {
    const double place = (static_cast<double>(x) - static_cast<double>(low)) / width;
    steps.push_back(std::isfinite(x) ? static_cast<std::int16_t>(std::lround(place * kSteps) - 32767)
                                     : kUnknown);
  }
  return {{"low", low}, {"high", high}, {"data", base64_of(steps)}};
}

}  // namespace

std::string data_of(const Flown& flown) {
  files::Json groups = files::Json::array(), logs = files::Json::array(), marks = files::Json::array();
  for (const Flown::Group& group : flown.groups)
    groups.push_back({{"name", group.name}, {"unit", group.unit}, {"columns", group.columns}});
  for (const Flown::Log& log : flown.logs) {
    files::Json columns = files::Json::array({base64_of(log.columns[0])});
    for (std::size_t k = 1; k < log.columns.size(); ++k) columns.push_back(column_json(log.columns[k]));
    logs.push_back({{"flight", log.flight},
                    {"vehicle", log.vehicle},
                    {"rows", log.columns[0].size()},
                    {"columns", std::move(columns)}});
  }
  for (const Flown::Mark& mark : flown.marks) {
    marks.push_back({{"flight", mark.flight},
                     {"vehicle", mark.vehicle},
                     {"time", mark.time_s},
                     {"rank", mark.rank},
                     {"size", mark.size}});
  }
  const files::Json all = {{"unit", flown.force_unit},
                           {"axis", flown.axis},
                           {"groups", std::move(groups)},
                           {"logs", std::move(logs)},
                           {"marks", std::move(marks)}};
  return script_json(all.dump(-1, ' ', true, files::Json::error_handler_t::replace));
}

std::string interactive(const std::string& id, const std::string& caption) {
  return "<figure><div id=\"" + id + "\"></div>\n<figcaption>" + html_text(caption) +
         "</figcaption></figure>\n";
}

}  // namespace swarmcert::analysis
