#include "notebooks_cpp/document.h"

#include <cmark.h>
#include <openssl/evp.h>

#include <cstdlib>
#include <memory>
#include <sstream>

namespace swarmcert::notebook {
namespace {

constexpr const char* kStyle =
    ":root{color-scheme:light dark}body{font:16px/1.5 system-ui,sans-serif;max-width:52rem;margin:2rem auto;"
    "padding:0 1rem}pre{overflow-x:auto;padding:.75rem;border-radius:4px;background:#8882;font-size:.85rem}"
    "pre.output{background:none;border-left:3px solid #888;border-radius:0}img{max-width:100%;height:auto;"
    "background:#fff}table{border-collapse:collapse}td,th{padding:.25rem .75rem;border-bottom:1px solid "
    "#888}";

std::string base64(const std::string& bytes) {
  std::string text(4 * ((bytes.size() + 2) / 3), '\0');
  EVP_EncodeBlock(reinterpret_cast<unsigned char*>(text.data()),
                  reinterpret_cast<const unsigned char*>(bytes.data()), static_cast<int>(bytes.size()));
  return text;
}

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text)
    result += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '>' ? "&gt;" : std::string(1, c);
  return result;
}

std::string html_of_markdown(const std::string& text) {
  const std::unique_ptr<char, void (*)(void*)> html(
      cmark_markdown_to_html(text.data(), text.size(), CMARK_OPT_DEFAULT), std::free);
  return html.get();
}

/// As notebooks keep text: a list of lines with their ends.
files::Json lines_of(const std::string& text) {
  files::Json lines = files::Json::array();
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(stream.eof() ? line : line + "\n");
  return lines;
}

files::Json json_of(const Output& output) {
  if (!output.is_plot())
    return {{"name", "stdout"}, {"output_type", "stream"}, {"text", lines_of(output.text)}};
  files::Json data = files::Json::object();
  if (!output.svg.empty()) data["image/svg+xml"] = lines_of(output.svg);
  if (!output.png.empty()) data["image/png"] = base64(output.png);
  data["text/plain"] = lines_of(output.text);
  return {{"data", std::move(data)},
          {"metadata", {{"swarmcert", {{"data", lines_of(output.data)}}}}},
          {"output_type", "display_data"}};
}

}  // namespace

files::Json to_ipynb(const std::vector<RunCell>& cells) {
  files::Json list = files::Json::array();
  int executed = 0;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const std::string id = "cell-" + std::to_string(i);
    if (!cells[i].is_code) {
      list.push_back({{"cell_type", "markdown"},
                      {"id", id},
                      {"metadata", files::Json::object()},
                      {"source", lines_of(cells[i].text)}});
      continue;
    }
    files::Json outputs = files::Json::array();
    for (const Output& output : cells[i].outputs) outputs.push_back(json_of(output));
    list.push_back({{"cell_type", "code"},
                    {"execution_count", ++executed},
                    {"id", id},
                    {"metadata", files::Json::object()},
                    {"outputs", std::move(outputs)},
                    {"source", lines_of(cells[i].text)}});
  }
  return {{"cells", std::move(list)},
          {"metadata",
           {{"kernelspec", {{"display_name", "C++17"}, {"language", "C++17"}, {"name", "xcpp17"}}},
            {"language_info", {{"file_extension", ".cpp"}, {"mimetype", "text/x-c++src"}, {"name", "c++"}}}}},
          {"nbformat", 4},
          {"nbformat_minor", 5}};
}

std::string to_html(const std::string& title, const std::vector<RunCell>& cells) {
  std::string html = "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>" +
                     escaped(title) +
                     "</title>\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
                     "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src "
                     "'unsafe-inline'; img-src data:\">\n<style>" +
                     kStyle + "</style></head><body>\n";
  for (const RunCell& cell : cells) {
    if (!cell.is_code) {
      html += html_of_markdown(cell.text);
      continue;
    }
    html += "<pre><code>" + escaped(cell.text) + "</code></pre>\n";
    for (const Output& output : cell.outputs) {
      if (output.svg.empty())
        html += "<pre class=\"output\">" + escaped(output.text) + "</pre>\n";
      else
        html += "<p><img alt=\"" + escaped(output.text) + "\" src=\"data:image/svg+xml;base64," +
                base64(output.svg) + "\"></p>\n";
    }
  }
  return html + "</body></html>\n";
}

std::string first_difference(const files::Json& committed, const files::Json& fresh) {
  const auto without_images = [](files::Json cell, int& images) {
    if (!cell.contains("outputs")) return cell;
    for (files::Json& output : cell["outputs"]) {
      if (!output.contains("data")) continue;
      for (const char* kind : {"image/svg+xml", "image/png"})
        images += static_cast<int>(output["data"].erase(kind));
    }
    return cell;
  };
  const files::Json &old_cells = committed["cells"], &new_cells = fresh["cells"];
  if (old_cells.size() != new_cells.size())
    return std::to_string(old_cells.size()) + " cells are committed, " + std::to_string(new_cells.size()) +
           " ran";
  for (std::size_t i = 0; i < old_cells.size(); ++i) {
    int old_images = 0, new_images = 0;
    const files::Json before = without_images(old_cells[i], old_images);
    const files::Json now = without_images(new_cells[i], new_images);
    if (before != now)
      return "cell " + std::to_string(i) + "\ncommitted: " + before.dump(1) + "\nfresh: " + now.dump(1);
    if (old_images != new_images)
      return "cell " + std::to_string(i) + ": " + std::to_string(old_images) + " images are committed, " +
             std::to_string(new_images) + " were drawn (gnuplot)";
  }
  return "";
}

}  // namespace swarmcert::notebook
