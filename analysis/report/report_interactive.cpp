#include "analysis/report/report_interactive.h"

#include <array>
#include <cmath>

#include "analysis/report/report_text.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {
namespace {

/// Rounds to a thousandth of a unit, which is less than a pixel; more digits would double the file.
files::Json thousandths(double x) {
  return std::isfinite(x) ? files::Json(std::round(x * 1000) / 1000) : files::Json(nullptr);
}

template <std::size_t Columns>
files::Json rows_json(const std::vector<std::array<float, Columns>>& rows) {
  files::Json json = files::Json::array();
  for (const std::array<float, Columns>& row : rows) {
    files::Json cells = files::Json::array();
    for (const float x : row) cells.push_back(thousandths(static_cast<double>(x)));
    json.push_back(std::move(cells));
  }
  return json;
}

std::string in_page(const files::Json& json) {
  return script_json(json.dump(-1, ' ', true, files::Json::error_handler_t::replace));
}

}  // namespace

std::string data_of(const std::vector<TimeSeries>& all, const std::string& unit) {
  files::Json series_json = files::Json::array();
  bool has_other = false;
  for (const TimeSeries& series : all) {
    files::Json marks = files::Json::array();
    for (const TimeSeries::Mark& mark : series.marks) {
      marks.push_back({{"time", thousandths(static_cast<double>(mark.time_s))},
                       {"rank", mark.rank},
                       {"size", thousandths(mark.size)}});
    }
    for (const std::array<float, 6>& row : series.rows) has_other = has_other || std::isfinite(row[5]);
    series_json.push_back(
        {{"name", series.name}, {"rows", rows_json(series.rows)}, {"marks", std::move(marks)}});
  }
  return in_page({{"unit", unit}, {"has_before", has_other}, {"series", std::move(series_json)}});
}

std::string data_of(const std::vector<Replay>& flights, const std::string& unit) {
  files::Json json = files::Json::array();
  for (const Replay& flight : flights) {
    files::Json vehicles = files::Json::array();
    for (const Replay::Vehicle& vehicle : flight.vehicles)
      vehicles.push_back({{"name", vehicle.name}, {"rows", rows_json(vehicle.rows)}});
    json.push_back({{"name", flight.name}, {"vehicles", std::move(vehicles)}});
  }
  return in_page({{"unit", unit}, {"flights", std::move(json)}});
}

std::string interactive(const std::string& id, const std::string& data, const std::string& caption) {
  return "<figure><div id=\"" + id + "\"></div>\n<script type=\"application/json\" id=\"" + id + "-data\">" +
         data + "</script>\n<figcaption>" + html_text(caption) + "</figcaption></figure>\n";
}

}  // namespace swarmcert::analysis
