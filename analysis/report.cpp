#include "analysis/report.h"

#include <fmt/core.h>
#include <openssl/evp.h>
#include <openssl/sha.h>
#include <spawn.h>
#include <sys/wait.h>

#include <cmath>
#include <filesystem>

#include "analysis/report_scripts.h"
#include "nn/files/file_io.h"
#include "nn/files/input_error.h"
#include "nn/files/json.h"

extern char** environ;

namespace swarmcert::analysis {
namespace {

constexpr const char* kStyle =
    "body{font:16px/1.5 system-ui,sans-serif;max-width:72rem;margin:2rem auto;padding:0 1rem;color:#1b1b1b;"
    "background:#fff}table{border-collapse:collapse;margin:1rem 0}td,th{padding:.25rem .75rem;"
    "border-bottom:1px solid #ccc;text-align:left;font-variant-numeric:tabular-nums}figure{margin:1.5rem 0}"
    "figcaption{color:#555}svg{max-width:100%;height:auto;background:#fff}pre{overflow-x:auto}.plot{width:"
    "100%;height:22rem}";

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

/// The source "'sha256-...'" by which a policy admits exactly this script.
std::string script_source(std::string_view script) {
  unsigned char digest[SHA256_DIGEST_LENGTH];
  SHA256(reinterpret_cast<const unsigned char*>(script.data()), script.size(), digest);
  unsigned char base64[4 * ((SHA256_DIGEST_LENGTH + 2) / 3) + 1];
  EVP_EncodeBlock(base64, digest, sizeof digest);
  return "'sha256-" + std::string(reinterpret_cast<const char*>(base64)) + "'";
}

/// JSON that may stand inside an HTML script element.
std::string data_of(const std::vector<TimeSeries>& all) {
  files::Json json = files::Json::array();
  for (const TimeSeries& series : all) {
    files::Json rows = files::Json::array(), marks = files::Json::array();
    for (const std::array<float, 5>& row : series.rows) {
      files::Json cells = files::Json::array();
      for (const float x : row) {
        // A thousandth of the unit is less than a pixel; more digits would double the file.
        cells.push_back(std::isfinite(x) ? files::Json(std::round(static_cast<double>(x) * 1000) / 1000)
                                         : files::Json(nullptr));
      }
      rows.push_back(std::move(cells));
    }
    for (const TimeSeries::Mark& mark : series.marks) {
      marks.push_back({{"time", std::round(static_cast<double>(mark.time_s) * 1000) / 1000},
                       {"rank", mark.rank},
                       {"gf", mark.size_gf}});
    }
    json.push_back({{"name", series.name}, {"rows", std::move(rows)}, {"marks", std::move(marks)}});
  }
  std::string text = json.dump(-1, ' ', true, files::Json::error_handler_t::replace);
  for (std::size_t at = text.find('<'); at != std::string::npos; at = text.find('<', at))
    text.replace(at, 1, "\\u003c");
  return text;
}

/// Runs gnuplot on a script of `folder`; false where there is none or it fails. The folder's name never reaches
/// gnuplot, whose strings can run commands.
bool draw(const std::filesystem::path& folder, const std::string& script) {
  const char* const arguments[] = {"gnuplot", script.c_str(), nullptr};
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
  posix_spawn_file_actions_addopen(&actions, 2, "/dev/null", 1, 0);
  pid_t child = 0;
  const int failed =
      posix_spawnp(&child, "gnuplot", &actions, nullptr, const_cast<char* const*>(arguments), environ);
  posix_spawn_file_actions_destroy(&actions);
  int status = 0;
  return failed == 0 && waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

}  // namespace

Report::Report(std::string title) : title_(std::move(title)) {}

void Report::heading(const std::string& text) { body_.push_back("<h2>" + escaped(text) + "</h2>\n"); }

void Report::paragraph(const std::string& text) { body_.push_back("<p>" + escaped(text) + "</p>\n"); }

void Report::table(const std::vector<std::string>& header,
                   const std::vector<std::vector<std::string>>& rows) {
  std::string html = "<table><thead><tr>";
  for (const std::string& cell : header) html += "<th>" + escaped(cell) + "</th>";
  html += "</tr></thead><tbody>\n";
  for (const std::vector<std::string>& row : rows) {
    html += "<tr>";
    for (const std::string& cell : row) html += "<td>" + escaped(cell) + "</td>";
    html += "</tr>\n";
  }
  body_.push_back(html + "</tbody></table>\n");
}

void Report::figure(const std::string& name, const std::string& data, const std::string& script,
                    const std::string& caption) {
  figures_.push_back({name, data, script, caption});
  body_.emplace_back();
}

void Report::time_series(const std::vector<TimeSeries>& all, const std::string& caption) {
  if (kTimeSeriesScript.empty()) {
    paragraph("Time series with zoom are missing: the tool was built without dygraphs (libjs-dygraphs).");
    return;
  }
  has_script_ = true;
  body_.push_back(
      "<figure><div id=\"time-series\"></div>\n<script type=\"application/json\" id=\"time-series-data\">" +
      data_of(all) + "</script>\n<figcaption>" + escaped(caption) + "</figcaption></figure>\n");
}

std::string Report::write(const std::string& folder, bool overwrite) const {
  const std::filesystem::path path(folder);
  if (std::filesystem::exists(path) && !overwrite &&
      (!std::filesystem::is_directory(path) || !std::filesystem::is_empty(path))) {
    throw files::InputError(
        {folder, "", "--report", "", "the folder is not empty", "--force writes into it"});
  }
  std::filesystem::create_directories(path);
  std::string html = "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>" +
                     escaped(title_) +
                     "</title>\n<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; "
                     "style-src 'unsafe-inline'; img-src data:" +
                     (has_script_ ? "; script-src " + script_source(kTimeSeriesScript) : "") +
                     "\">\n<style>" + kStyle + (has_script_ ? std::string(kTimeSeriesStyle) : "") +
                     "</style></head><body>\n<h1>" + escaped(title_) + "</h1>\n";
  std::size_t next_figure = 0;
  for (const std::string& part : body_) {
    if (!part.empty()) {
      html += part;
      continue;
    }
    const Figure& figure = figures_[next_figure++];
    files::write_file((path / (figure.name + ".dat")).string(), figure.data, true);
    files::write_file((path / (figure.name + ".gp")).string(),
                      "set terminal svg size 800,420 dynamic font 'sans-serif,13'\nset output '" +
                          figure.name + ".svg'\nset encoding utf8\n" + figure.script,
                      true);
    html += "<figure>\n";
    if (draw(path, figure.name + ".gp")) {
      const std::string svg = files::read_file((path / (figure.name + ".svg")).string());
      html += svg.substr(svg.find("<svg"));
    } else {
      html += "<p>Not drawn: gnuplot is missing or failed. The data are in " + escaped(figure.name) +
              ".dat.</p>\n";
    }
    html += "<figcaption>" + escaped(figure.caption) + "</figcaption></figure>\n";
  }
  const std::string report = (path / "report.html").string();
  if (has_script_) html += "<script>" + std::string(kTimeSeriesScript) + "</script>\n";
  files::write_file(report, html + "</body></html>\n", true);
  return report;
}

}  // namespace swarmcert::analysis
