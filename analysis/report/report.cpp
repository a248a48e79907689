#include "analysis/report/report.h"

#include <fmt/core.h>
#include <openssl/sha.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "analysis/report/report_drawing.h"
#include "analysis/report/report_interactive.h"
#include "analysis/report/report_scripts.h"
#include "analysis/report/report_text.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {
namespace {

/// Returns the source "'sha256-...'" by which a content security policy admits exactly this script or style.
std::string policy_source(std::string_view text) {
  unsigned char digest[SHA256_DIGEST_LENGTH];
  SHA256(reinterpret_cast<const unsigned char*>(text.data()), text.size(), digest);
  return "'sha256-" + base64(std::string_view(reinterpret_cast<const char*>(digest), sizeof digest)) + "'";
}

/// Returns a drawing as the address of an image: browsers do not run scripts in images and load nothing for them.
std::string image_address(const std::string& svg) { return "data:image/svg+xml;base64," + base64(svg); }

/// Whether a cell is a number, possibly with a unit; such cells are right-aligned.
bool is_number(const std::string& cell) {
  return !cell.empty() && cell.find_first_not_of("0123456789.+-eE %") == std::string::npos;
}

/// How a cell breaks into lines: numbers and short texts do not, lists do, and long texts get room.
const char* class_of(const std::string& cell) {
  constexpr std::size_t kShort_chars = 26, kLong_chars = 40;
  const bool is_short = cell.size() <= kShort_chars && cell.find(", ") == std::string::npos;
  return is_number(cell) ? "number" : is_short ? "short" : cell.size() > kLong_chars ? "long" : "text";
}

}  // namespace

Report::Report(std::string title) : title_(std::move(title)) {}

void Report::result(const nlohmann::ordered_json& result) { result_json_ = files::to_text(result); }

void Report::result(const files::Node& result) { this->result(files::to_json(result)); }

void Report::made_by(const std::string& command) { command_ = command; }

void Report::heading(const std::string& text) { body_.push_back("<h2>" + html_text(text) + "</h2>\n"); }

void Report::paragraph(const std::string& text) { body_.push_back("<p>" + html_text(text) + "</p>\n"); }

void Report::literal(const std::string& text) { body_.push_back("<pre>" + html_text(text) + "</pre>\n"); }

void Report::facts(const std::vector<std::pair<std::string, std::string>>& facts) {
  std::string html = "<dl>\n";
  for (const auto& [name, words] : facts)
    html += "<dt>" + html_text(name) + "</dt><dd>" + html_text(words) + "</dd>\n";
  body_.push_back(html + "</dl>\n");
}

void Report::table(const std::vector<std::string>& header,
                   const std::vector<std::vector<std::string>>& rows) {
  // Wide tables scroll on their own, also by keyboard.
  std::string html = fmt::format(
      "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"table {}\"><table><thead><tr>",
      ++tables_);
  for (const std::string& cell : header)
    html += cell.empty() ? "<td></td>" : "<th scope=\"col\">" + html_text(cell) + "</th>";
  html += "</tr></thead><tbody>\n";
  for (const std::vector<std::string>& row : rows) {
    html += "<tr>";
    for (const std::string& cell : row)
      html += fmt::format("<td class=\"{}\">", class_of(cell)) + html_text(cell) + "</td>";
    html += "</tr>\n";
  }
  body_.push_back(html + "</tbody></table></div>\n");
}

void Report::figure(const std::string& name, const std::string& data, const std::string& script,
                    const std::string& caption, int height) {
  figures_.push_back({name, data, script, caption, height});
  body_.emplace_back();
}

void Report::bars(const std::string& name, const std::vector<Bar>& bars, const std::string& quantity,
                  const std::string& caption) {
  if (bars.empty()) return;
  std::string data = "# value lower upper name\n";
  double largest = 0;
  for (const Bar& bar : bars) {
    for (const double x : {bar.value, bar.upper}) largest = std::isfinite(x) ? std::max(largest, x) : largest;
    const auto end = [&bar](double x) { return std::isfinite(x) ? x : bar.value; };
    data += fmt::format("{:.10g} {:.10g} {:.10g} {}\n", bar.value, end(bar.lower), end(bar.upper),
                        plot_field(bar.name));
  }
  figure(name, data,
         fmt::format(
             // The names of the bars take half of a narrow drawing: the axis label goes below all of it.
             "if (exists('narrow')) {{ set xtics {3:g}; set bmargin 4; "
             "set label 1 {0} at screen 0.5, screen 0.03 center }} else {{ set xlabel {0} }}\nset key off\n"
             "set style fill solid 0.9 noborder\nset ytics nomirror\n"
             "set yrange [{1}.6:-0.6]\nset xrange [*<0:*]\nset grid x noy\n"
             "plot '{2}.dat' using (0):0:(0):1:($0-0.35):($0+0.35):ytic(4) with boxxyerror, "
             "'' using 1:0:2:3 with xerrorbars linecolor rgb 'black' dashtype 1 pointtype 0 linewidth 1.5\n",
             plot_string(quantity), bars.size() - 1, name, 2 * tick_step(largest)),
         caption, 120 + 32 * static_cast<int>(bars.size()));
}

void Report::flown(const Flown& flown, const std::string& over_time, const std::string& in_space) {
  has_time_series_ = !kTimeSeriesScript.empty();
  has_replay_ = !kReplayScript.empty();
  if (has_time_series_ || has_replay_)
    body_.push_back("<script type=\"application/json\" id=\"flown-data\">" + data_of(flown) + "</script>\n");
  heading("Over time");
  if (has_time_series_)
    body_.push_back(interactive("time-series", over_time));
  else
    paragraph("Signals over time are missing: the tool was built without dygraphs (libjs-dygraphs).");
  heading("In space");
  if (has_replay_)
    body_.push_back(interactive("replay", in_space));
  else
    paragraph("The view in space is missing: the tool was built without three.js (libjs-three).");
}

void Report::moments(const std::vector<ShownMoment>& moments) {
  std::string html =
      "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"worst moments\"><table><thead><tr>"
      "<th scope=\"col\">rank</th><th scope=\"col\">log</th><th scope=\"col\">time on the log [s]</th>"
      "<th scope=\"col\">residual</th></tr></thead><tbody>\n";
  int rank = 0;
  for (const ShownMoment& moment : moments) {
    html += fmt::format(
        "<tr><td class=\"number\">{0} <button type=\"button\" class=\"jump\" hidden "
        "aria-label=\"Show worst moment {0}\" data-flight=\"{1}\" data-vehicle=\"{2}\" "
        "data-flight-time=\"{3:.3f}\">Show</button></td><td>{1} {2}</td><td class=\"number\">{4:.2f}</td>"
        "<td>{5}</td></tr>\n",
        ++rank, html_text(moment.flight), html_text(moment.vehicle), moment.time_s, moment.log_time_s,
        html_text(moment.size));
  }
  body_.push_back(html + "</tbody></table></div>\n");
}

std::string Report::drawn(const Figure& figure, const std::string& folder) const {
  const std::filesystem::path path(folder);
  const std::string script = figure.name + ".gp";
  files::write_file((path / (figure.name + ".dat")).string(), figure.data, true);
  files::write_file((path / script).string(), plot_script(figure.script, figure.height), true);
  const std::string wide = draw(folder, script, false), narrow = draw(folder, script, true);
  std::string html = "<figure class=\"drawing\">\n";
  if (!wide.empty() && !narrow.empty()) {
    files::write_file((path / (figure.name + ".svg")).string(), wide, true);
    html += fmt::format(
        "<picture><source media=\"screen and (max-width:40rem)\" srcset=\"{}\"><img src=\"{}\" "
        "alt=\"Plot: {}\"></picture>\n",
        image_address(narrow), image_address(wide), html_text(figure.caption));
  } else {
    html += "<p>Not drawn: gnuplot is missing or failed. The data are in " + html_text(figure.name) +
            ".dat.</p>\n";
  }
  return html + "<figcaption>" + html_text(figure.caption) + "</figcaption></figure>\n";
}

std::string Report::write(const std::string& folder, bool overwrite, const std::string& page) const {
  const std::filesystem::path path(folder);
  if (std::filesystem::exists(path) && !overwrite &&
      (!std::filesystem::is_directory(path) || !std::filesystem::is_empty(path))) {
    throw files::InputError(
        {folder, "", "--report", "", "the folder is not empty", "--force writes into it"});
  }
  std::filesystem::create_directories(path);
  const std::string style = std::string(kPageStyle) + (has_time_series_ ? std::string(kTimeSeriesStyle) : "");
  const std::string script = std::string(kPageScript) +
                             (has_time_series_ ? std::string(kTimeSeriesScript) : "") +
                             (has_replay_ ? std::string(kReplayScript) : "");
  std::string html =
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; base-uri 'none'; "
      "form-action 'none'; img-src data:; style-src " +
      policy_source(style) + "; script-src " + policy_source(script) +
      "\">\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>" +
      html_text(title_) + "</title>\n<style>" + style + "</style></head><body><main>\n<h1>" +
      html_text(title_) + "</h1>\n";
  std::size_t next_figure = 0;
  for (const std::string& part : body_) html += part.empty() ? drawn(figures_[next_figure++], folder) : part;
  html += "<h2>How it was made</h2>\n";
  if (!command_.empty()) {
    html += "<pre id=\"command\">" + html_text(command_) +
            "</pre>\n<button type=\"button\" data-copies=\"command\" hidden>Copy the command</button>\n";
  }
  if (!result_json_.empty()) {
    html +=
        "<button type=\"button\" data-copies=\"result\" hidden>Copy the result as JSON</button>\n"
        "<script type=\"application/json\" id=\"result\">" +
        script_json(result_json_) + "</script>\n";
  }
  html += "<p>swarmcert " SWARMCERT_VERSION "</p>\n</main><script>" + script + "</script>\n</body></html>\n";
  const std::string report = (path / page).string();
  files::write_file(report, html, true);
  return report;
}

}  // namespace swarmcert::analysis
