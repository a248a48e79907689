#include "analysis/report.h"

#include <spawn.h>
#include <sys/wait.h>

#include <filesystem>

#include "nn/files/file_io.h"
#include "nn/files/input_error.h"

extern char** environ;

namespace swarmcert::analysis {
namespace {

constexpr const char* kStyle =
    "body{font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#1b1b1b;"
    "background:#fff}table{border-collapse:collapse;margin:1rem 0}td,th{padding:.25rem .75rem;"
    "border-bottom:1px solid #ccc;text-align:left;font-variant-numeric:tabular-nums}figure{margin:1.5rem 0}"
    "figcaption{color:#555}svg{max-width:100%;height:auto;background:#fff}pre{overflow-x:auto}";

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

/// Runs gnuplot on a script in `folder`; false where there is none or it fails.
bool draw(const std::filesystem::path& report_folder, const std::string& script) {
  const std::filesystem::path folder = std::filesystem::absolute(report_folder);
  const std::string path = (folder / script).string();
  const std::string change_folder = "cd '" + folder.string() + "'";
  const char* const arguments[] = {"gnuplot", "-e", change_folder.c_str(), path.c_str(), nullptr};
  if (folder.string().find('\'') != std::string::npos)
    return false;  // gnuplot cannot be given such a folder safely
  posix_spawn_file_actions_t quiet;
  posix_spawn_file_actions_init(&quiet);
  posix_spawn_file_actions_addopen(&quiet, 2, "/dev/null", 1, 0);
  pid_t child = 0;
  const int failed =
      posix_spawnp(&child, "gnuplot", &quiet, nullptr, const_cast<char* const*>(arguments), environ);
  posix_spawn_file_actions_destroy(&quiet);
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
                     "style-src 'unsafe-inline'; img-src data:\">\n<style>" +
                     kStyle + "</style></head><body>\n<h1>" + escaped(title_) + "</h1>\n";
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
  files::write_file(report, html + "</body></html>\n", true);
  return report;
}

}  // namespace swarmcert::analysis
